// SPDX-License-Identifier: Apache-2.0
#include "inner_tiles.h"

namespace fibrolite {
namespace {

using Tree = openvdb::FloatTree;
using Large = Tree::RootNodeType::ChildNodeType;
using Small = Large::ChildNodeType;

template <class Node>
void add_tiles(const Tree& tree, std::vector<openvdb::CoordBBox>& boxes) {
  std::vector<const Node*> nodes;
  tree.getNodes(nodes);
  for (const Node* node : nodes) {
    const auto* table = node->getTable();
    for (openvdb::Index n = 0; n < Node::NUM_VALUES; ++n) {
      if (node->isChildMaskOn(n) || table[n].getValue() >= 0) continue;
      boxes.push_back(openvdb::CoordBBox::createCube(node->offsetToGlobalCoord(n), Node::ChildNodeType::DIM));
    }
  }
}

}  // namespace

std::vector<openvdb::CoordBBox> inner_tiles(const Tree& tree) {
  std::vector<openvdb::CoordBBox> boxes;
  add_tiles<Small>(tree, boxes);
  add_tiles<Large>(tree, boxes);
  for (auto tile = tree.root().cbeginValueAll(); tile; ++tile)
    if (*tile < 0) boxes.push_back(openvdb::CoordBBox::createCube(tile.getCoord(), Large::DIM));
  return boxes;
}

}  // namespace fibrolite
