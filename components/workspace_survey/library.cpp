#include "components/workspace_survey/library.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "common/runtime/config_reader.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ConfigError;

constexpr std::array kMeshEndings{".stl", ".obj", ".ply", ".off", ".gltf", ".glb", ".dae", ".3mf", ".x"};

std::vector<LibraryPart> listed_parts(const std::filesystem::path& list) {
  const auto file = runtime::ConfigReader::from_file(list);
  std::vector<LibraryPart> parts;
  std::set<std::string> names;
  for (const auto& entry : file.sections("parts")) {
    LibraryPart part;
    part.name = entry.text("name");
    part.mesh = entry.path("mesh");
    part.import.scale = entry.number("mesh_scale", {1e-6, 1e3, "m per mesh unit"});
    part.import.y_up = entry.choice("up_axis", "z", {"z", "y"}) == "y";
    part.cell_mesh = entry.text("cell_mesh", "");
    if (part.name.empty() || part.name.size() > 64)
      throw entry.error("name", "has " + std::to_string(part.name.size()) + " bytes; allowed: 1 to 64");
    if (!names.insert(part.name).second) throw entry.error("name", "is another part's, too");
    if (!std::filesystem::is_regular_file(part.mesh))
      throw entry.error("mesh", "is not a file (" + part.mesh.string() + ")");
    parts.push_back(std::move(part));
  }
  file.finish();
  return parts;
}

std::vector<LibraryPart> found_parts(const std::filesystem::path& folder) {
  std::vector<LibraryPart> parts;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!entry.is_regular_file() ||
        std::find(kMeshEndings.begin(), kMeshEndings.end(), ending) == kMeshEndings.end())
      continue;
    LibraryPart part;
    part.name = entry.path().stem().string();
    part.mesh = entry.path();
    parts.push_back(std::move(part));
  }
  std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.mesh < b.mesh; });
  return parts;
}

}  // namespace

Library load_library(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw core::MissingError(folder.string() + ": no such folder of CAD models");
  const auto list = folder / "library.yaml";
  Library library;
  library.parts = std::filesystem::exists(list) ? listed_parts(list) : found_parts(folder);
  if (library.parts.empty())
    throw ConfigError(folder.string() + ": holds no part; allowed: a library.yaml, or mesh files");
  for (LibraryPart& part : library.parts) {
    const auto mesh = geometry::load_mesh(part.mesh, part.import);
    if (!mesh) throw ConfigError("part '" + part.name + "': " + mesh.status().message());
    part.notes = mesh->notes;
    library.models.push_back(survey::make_part(part.name, *mesh));
    if (library.models.back().loops.empty())
      throw ConfigError("part '" + part.name + "': " + part.mesh.string() +
                        ": has no plane face with corners; nothing of it can be measured");
  }
  return library;
}

std::size_t find_part(const Library& library, const std::string& name) {
  std::string known;
  for (std::size_t i = 0; i < library.parts.size(); ++i) {
    if (library.parts[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + library.parts[i].name;
  }
  throw ConfigError("part '" + name + "' is not in the library; allowed: " + known);
}

}  // namespace phantom::workspace_survey
