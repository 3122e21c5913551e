#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/workspace_camera/pose_check.hpp"

namespace phantom::workspace_camera {

/// What two images of a camera agree on.
struct ConfirmedFinding {
  std::size_t camera = 0;
  PoseFinding finding;
};

/// Returns a finding as a sentence.
std::string sentence(const PoseFinding& finding);

/// Keeps what images of several cameras show, and reports what two of one camera agree on.
class ConfirmedFindings {
 public:
  explicit ConfirmedFindings(double tolerance_m) : tolerance_m_(tolerance_m) {}

  /// Takes the findings of an image.
  void take(std::size_t camera, const std::vector<PoseFinding>& findings);
  /// Forgets what was said of an object, which was moved, or by a camera, which was.
  void forget(std::uint16_t id);
  void forget_camera(std::size_t camera);
  /// Returns a finding for each object of which a camera has found something: of the camera that said first
  /// that it does not stand where the model has it; else of the first that sees it agree.
  std::vector<ConfirmedFinding> reported() const;

 private:
  struct Entry {
    std::size_t camera = 0;
    PoseFinding latest, reported;  // reported.verdict: kUnseen: nothing
  };
  const double tolerance_m_;
  std::vector<Entry> entries_;
};

}  // namespace phantom::workspace_camera
