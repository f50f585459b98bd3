// SPDX-License-Identifier: GPL-3.0-or-later
// Columns inside bulk: cores of fibres where the load runs.
#pragma once

#include "fibrolite/context.h"
#include "fibrolite/ops/partition.h"
#include "fibrolite/ops/verify.h"

namespace fibrolite {

/// The whole body as one bulk candidate: what cores are cut out of if parts are found by load alone.
[[nodiscard]] Partition undivided(const Proxy& proxy);

struct CoreParams {
  double concentration = 1.5;    ///< As PartitionParams.
  double share = 0.7;            ///< As PartitionParams::core_share.
  double min_slenderness = 1.0;  ///< As PartitionParams.
  double least_mm = 6.4;         ///< Diameter that the infill of a core needs; thinner ones are widened. Above 0.
};
/// The partition with a straight core wherever the stress of all load cases together runs in one direction through a
/// candidate that is not column-like. With S the sum over load cases of the stress tensor squared, and its eigenvalues
/// a >= b >= c: the load runs in one direction where a >= dominance^2 b, and a core starts where sqrt(a) is
/// `concentration` times the body's mean. From there it is followed over neighbours that point the same way; its axis
/// is their mean direction through their centre. Where the stress along the axis is largest, its section is `share` of
/// the one that would carry there, at that stress, all that runs through the host: of an evenly pressed patch that is a
/// share of the patch. A core runs from surface to surface. There is none if it would be shorter than wide, lie at the
/// surface instead of inside, take more than half of its host, be stressed less than `concentration` times the body's
/// mean, or cross another core; a note says why.
/// Load cases that are unplanned do not count. @throws Error as verify(). Cost: one coarse solve, seconds.
/// Source: ours.
[[nodiscard]] Partition find_cores(const Proxy& proxy, Partition partition, const CoreParams& params,
                                   const VerifyParams& loads = {}, const Material& material = {},
                                   const Context& context = {});

}  // namespace fibrolite
