#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/mesh_io.hpp"
#include "common/survey/part.hpp"

namespace phantom::workspace_survey {

/// A part of the library.
struct LibraryPart {
  std::string name;
  std::filesystem::path mesh;
  geometry::MeshImportOptions import;  ///< the mesh's unit and up-axis
  std::string cell_mesh;  ///< the same mesh's file in the cell's folder; empty: it travels with the command
  std::vector<std::string> notes;  ///< what had to be assumed
};

/// A library of CAD models, with their features in the same order.
struct Library {
  std::vector<LibraryPart> parts;
  std::vector<survey::PartModel> models;
};

/// Reads a folder: the parts that its library.yaml lists or, without one, every mesh file in it (unit and
/// up-axis as declared or guessed, with notes). Throws core::ConfigError naming file and what is wrong,
/// MissingError for a folder that is not there.
Library load_library(const std::filesystem::path& folder);

/// Index of the part called `name`. Throws core::ConfigError naming those there are.
std::size_t find_part(const Library& library, const std::string& name);

}  // namespace phantom::workspace_survey
