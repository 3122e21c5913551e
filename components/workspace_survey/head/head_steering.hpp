#pragma once

#include <iosfwd>
#include <optional>
#include <sstream>
#include <string>

#include "common/survey/next_corner.hpp"
#include "components/workspace_survey/head/head_driver.hpp"

namespace phantom::workspace_survey {

/// Steers a head in the assistant's dialogue: turns it where a person, or the model found so far, says, and
/// takes readings. Prints what it does, and every error, on `out`. The head's errors are errors of that line
/// only.
class HeadSteering {
 public:
  /// `readings`: of one corner, averaged.
  HeadSteering(SteeredHead& head, const survey::RangeHead& mounted, const survey::HeadErrors& errors,
               int readings, std::ostream& out);

  /// `aim PAN TILT`, in degrees.
  void aim(std::istringstream& words);
  /// `jog DPAN DTILT`, in degrees: from where it stands.
  void jog(std::istringstream& words);
  /// Turns the head to a point. Returns whether it stands there.
  bool aim_at(const Eigen::Vector3d& p_W_m);
  /// Takes a reading of the corner at which it points: the mean of several. None if the head has an error, or
  /// if they differ by more than their errors, as over an edge.
  std::optional<survey::Reading> measure();
  /// Returns where the head stands; none if it was not aimed, or has had an error.
  const std::optional<survey::Reading>& pointing() const { return pointing_; }

 private:
  bool turn(double pan_rad, double tilt_rad);
  std::optional<std::pair<double, double>> angles_in(std::istringstream& words, const char* usage);

  SteeredHead& head_;
  const survey::RangeHead& mounted_;
  const survey::HeadErrors& errors_;
  int readings_;
  std::ostream& out_;
  std::optional<survey::Reading> pointing_;
};

}  // namespace phantom::workspace_survey
