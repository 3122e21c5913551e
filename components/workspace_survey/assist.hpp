#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "components/workspace_survey/assist_view.hpp"
#include "components/workspace_survey/head/head_driver.hpp"
#include "components/workspace_survey/report.hpp"

namespace phantom::workspace_survey {

/// What became of sending an object to the workspace.
struct Sent {
  std::string message;  ///< for the person
  int exit_code = 0;    ///< that the executable ends with unless a later one is sent
};

struct AssistSetup {
  workspace::VoxelSize voxel_size_m = 0.01;
  /// What a simulated head targets, for practice: an empty line takes the next one. Empty: no simulated head.
  std::vector<survey::Targeting> practice;
  /// A head that is steered from the dialogue; null: a person reads it and types.
  SteeredHead* head = nullptr;
  int readings = 5;  ///< of a corner by that head, averaged
  /// Shows what agrees, for a person to pick, and returns a message. Null: nothing is shown but the text.
  std::function<std::string(const SurveyReport& report)> show;
  /// Sends the fitted object to the workspace. Null: sending is not possible.
  std::function<Sent(const SurveyReport& report)> send;
  /// Called before each prompt. Null: nobody looks.
  std::function<void(const AssistView& view)> on_prompt;
  /// Writes the targetings to a file and returns a message for the person.
  std::function<std::string(const std::string& file, const std::vector<survey::Targeting>&)> save;
};

/// Leads a person through targeting in a dialogue of lines: face by face, corner by corner. After each face
/// it prints what the error aid reports, which parts remain, and what to measure next or again; finally pose,
/// uncertainty and guard. Uses no terminal: reads lines from `in` until its end or `quit`. Returns the exit
/// code: the last send's if that failed, otherwise whether an object is fitted at the end.
int assist(const Config& config, const Library& library, const AssistSetup& setup, std::istream& in,
           std::ostream& out);

}  // namespace phantom::workspace_survey
