#include "components/workspace_survey/assist_lines.hpp"

#include <algorithm>
#include <sstream>

#include "common/core/units.hpp"

namespace phantom::workspace_survey {

const char* const kHeadHelp =
    "  aim PAN TILT          turn the head there, in degrees\n"
    "  jog DPAN DTILT        turn it by so much\n"
    "  next                  turn it to the next corner, as far as the best candidate shows where it is\n"
    "  measure               take the corner at which the head points; "
    "again NODE, more NODE without a reading likewise\n";
const char* const kHelp =
    "  RANGE PAN TILT        the reading of the next corner: range in mm, pan and tilt in degrees\n"
    "  =NODE                 the next corner is a node that was measured before, on another face\n"
    "  done                  the face is complete: all corners of its border were targeted, in order\n"
    "  part                  the face ends here, but it has more corners (an edge, a corner, "
    "a part of a border)\n"
    "  again NODE RANGE PAN TILT   a better reading in place of a node's old one\n"
    "  more NODE RANGE PAN TILT    a further reading of a node: they are averaged\n"
    "  undo                  forget the last corner\n"
    "  show                  what was measured, what it may be, and where\n"
    "  save FILE             keep the readings as CSV\n"
    "  pick N                it is alternative N, by your own eyes; holds until more is measured\n"
    "  send                  tell the running workspace (once a pose is accepted)\n"
    "  help, quit\n";

std::optional<survey::Reading> reading_in(const std::string& line) {
  std::string spaced = line;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::istringstream words(spaced);
  double range_mm = 0.0, pan_deg = 0.0, tilt_deg = 0.0;
  std::string rest;
  if (!(words >> range_mm >> pan_deg >> tilt_deg) || words >> rest) return std::nullopt;
  return survey::Reading{1e-3 * range_mm, core::kRadPerDegree * pan_deg, core::kRadPerDegree * tilt_deg};
}

}  // namespace phantom::workspace_survey
