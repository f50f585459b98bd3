// SPDX-License-Identifier: GPL-3.0-or-later
// --resume: what a run has finished stays beside its output until it is done, and a later run goes on from there.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "fibrolite/context.h"
#include "fibrolite/kept_work.h"
#include "fibrolite/ops/recipe.h"
#include "outputs.h"

namespace fibrolite::cli {

/// All that the bytes of a run depend on, a line each, as KeptWork compares it. Names are those of the user, so that he
/// is told which of his options differs.
class WorkText {
 public:
  /// The program itself, as built.
  explicit WorkText(const Context& context);
  void add(const std::string& name, const std::string& value);
  void add(const std::string& name, double value);                            ///< To the last bit.
  void add_file(const std::string& name, const std::filesystem::path& file);  ///< Its content.
  void add(const Recipe& recipe);                                             ///< Key by key, and the files it names.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  Context context_;
  std::string text_;
};

/// The hidden folder `.NAME.resume` beside an output NAME. From here on a run that is cancelled says how to go on,
/// unless nothing is finished yet: then the folder goes again. One at a time.
class Resume {
 public:
  /// Also removes what a run that was killed has left of its outputs.
  /// @throws as KeptWork.
  Resume(const std::filesystem::path& output, const WorkText& work, const Outputs& outputs, const Context& context);
  ~Resume();
  Resume(const Resume&) = delete;
  Resume& operator=(const Resume&) = delete;
  [[nodiscard]] const std::shared_ptr<KeptWork>& kept() const { return kept_; }
  /// The outputs are in their place: nothing need be kept.
  void done();

 private:
  std::shared_ptr<KeptWork> kept_;
};

}  // namespace fibrolite::cli
