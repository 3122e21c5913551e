#pragma once

#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "components/workspace_survey/report.hpp"

namespace phantom::workspace_survey {

/// A corner that a simulated head would target next, for practice.
struct PracticeShot {
  std::string face, node;
  bool closed = true;
  bool known = false;  ///< the corner was targeted on an earlier face
  survey::Reading reading;
  bool last_of_face = false;
};

struct AssistSetup {
  double voxel_size_m = 0.01;
  std::vector<PracticeShot>
      practice;  ///< an empty line takes the next of these; empty: no head to practise with
  /// Tells the workspace; returns what was said. Null: there is nobody to tell.
  std::function<std::string(const Told& told)> send;
  /// Writes a file; returns what there is to say about it.
  std::function<std::string(const std::string& file, const std::vector<survey::Targeting>&)> save;
};

/// Leads a person through targeting in a dialogue of lines: face by face, corner by corner, with what the
/// error aid says of each face, which parts remain, and what to measure next or again; then pose, uncertainty
/// and guard. Knows no terminal: reads lines from `in` until its end or `quit`. Returns whether an object was
/// fitted when it ended.
bool assist(const Config& config, const Library& library, const AssistSetup& setup, std::istream& in,
            std::ostream& out);

}  // namespace phantom::workspace_survey
