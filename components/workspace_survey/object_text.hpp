#pragma once

#include <string>

#include "components/workspace_survey/library.hpp"

namespace phantom::workspace_survey {

/// YAML of an object as wva_server adds it: the part under `name` at a pose, with a guard skin; its mesh by
/// the file in the cell's folder, or written out. Throws core::ConfigError for a mesh that is too large to
/// travel.
std::string object_text(const LibraryPart& part, const survey::PartModel& model, const std::string& name,
                        const geometry::Pose& X_WO, int guard_vox);

}  // namespace phantom::workspace_survey
