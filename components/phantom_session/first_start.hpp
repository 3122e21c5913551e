#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace phantom::phantom_session {

/// What a person may begin with who has no topology yet.
enum class Beginning { kDemo, kOwnCell, kOwnArm };

/// Asks which, and of what is one's own in which folder, until there is an answer. An empty line is the demo;
/// so is the end of the input. `folder`: where to begin; empty for the demo.
struct FirstAnswer {
  Beginning beginning = Beginning::kDemo;
  std::filesystem::path folder;
};
FirstAnswer ask_first_start(std::istream& in, std::ostream& out);

/// Copies what a cell or an arm of one's own begins with into `folder`, which is made: a topology that runs
/// as it is, its cell, the meshes or the URDF, and the reaches of the simulated operator. `deploy`: the
/// folder of the shipped ones. Returns what is there and what to do next, in lines. Throws ConfigError if
/// something is in the folder, MissingError if it cannot be written.
std::string begin_own(Beginning beginning, const std::filesystem::path& folder,
                      const std::filesystem::path& deploy);

}  // namespace phantom::phantom_session
