#pragma once

#include <string>

#include "components/workspace_survey/library.hpp"

namespace phantom::workspace_survey {

/// Returns the YAML of an object for wva_server: the part under `name` at a pose, with a guard skin. The mesh
/// is a file in the cell's folder, or contained in the text. Throws core::ConfigError for a mesh that is too
/// large for a command.
std::string object_text(const LibraryPart& part, const survey::PartModel& model, const std::string& name,
                        const geometry::Pose& X_WO, int guard_vox);

}  // namespace phantom::workspace_survey
