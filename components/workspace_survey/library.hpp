#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/mesh/mesh_io.hpp"
#include "common/survey/part.hpp"

namespace phantom::workspace_survey {

/// A part of the library.
struct LibraryPart {
  std::string name;
  std::filesystem::path mesh;
  geometry::MeshImportOptions import;  ///< the mesh's unit and up axis
  std::filesystem::path image;         ///< picture of the part; empty: one is made from its mesh
  std::string cell_mesh;           ///< the mesh's file in the cell's folder; empty: the command contains it
  std::vector<std::string> notes;  ///< assumptions made about the mesh
};

/// A part whose mesh cannot be used.
struct UnusablePart {
  std::string name, problem;  ///< the problem names the part, too
};

/// A library of CAD models. `models` holds the features of `parts` in the same order.
struct Library {
  std::vector<LibraryPart> parts;
  std::vector<survey::PartModel> models;
  std::vector<UnusablePart> unusable;
};

extern const char* const kPartKeys;  ///< table of the keys of a library.yaml (library.yaml here)

/// Reads a folder: the parts that its library.yaml lists or, without one, every mesh file in it (unit and up
/// axis as declared or guessed, with notes). A part whose mesh is broken, or has nothing that can be
/// measured, is left out and named as unusable. Throws core::ConfigError that names the file and the fault
/// for a faulty list and where no part is usable, MissingError for a folder or mesh that does not exist.
Library load_library(const std::filesystem::path& folder);

/// Returns a line for each part by which a person tells them apart (thesis A.2.4): size, the longest length
/// of the box round it to the shortest, the number of plane faces, and the lengths of edges (from 20 mm on)
/// that no edge of another part has, to `apart_m`.
std::string parts_text(const Library& library, double apart_m);

/// Returns the index of the part called `name`. Throws core::ConfigError that names the existing
/// parts, or why this one is unusable.
std::size_t find_part(const Library& library, const std::string& name);

}  // namespace phantom::workspace_survey
