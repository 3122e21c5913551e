#include "components/workspace_survey/library.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/core/text.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/runtime/configuration/named.hpp"
#include "common/survey/visible.hpp"
#include "components/workspace_survey/part_picture.hpp"

namespace phantom::workspace_survey {
namespace {

using core::ConfigError;

constexpr std::array kMeshEndings{".stl", ".obj", ".ply", ".off", ".gltf", ".glb", ".dae", ".3mf", ".x"};

std::vector<LibraryPart> listed_parts(const std::filesystem::path& list) {
  const runtime::Fields file(list, {kPartKeys});
  std::vector<LibraryPart> parts;
  for (const runtime::Fields& entry : file.sections("parts")) {
    LibraryPart part{.name = entry.text("name"), .mesh = entry.existing_file("mesh")};
    entry.number("mesh_scale", part.import.scale);
    part.import.y_up = false;
    entry.choice("up_axis", part.import.y_up, {{"z", false}, {"y", true}});
    if (!entry.text("image").empty()) part.image = entry.existing_file("image");
    entry.text("cell_mesh", part.cell_mesh);
    entry.check(std::ranges::find(parts, part.name, &LibraryPart::name) == parts.end(), "name",
                "is another part's, too");
    parts.push_back(std::move(part));
  }
  file.finish();
  return parts;
}

std::vector<LibraryPart> found_parts(const std::filesystem::path& folder) {
  std::vector<LibraryPart> parts;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string ending = core::lower_case(entry.path().extension().string());
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

/// Returns the lengths of a part's edges that can be measured, each once, to 0.1 mm.
std::set<double> edge_lengths_m(const survey::PartModel& part) {
  const double least_m = survey::VisibleOptions().least_edge_m;
  std::set<double> lengths_m;
  for (const auto& [from, to] : survey::sharp_edges(part)) {
    const double length_m = (part.nodes_O_m[to] - part.nodes_O_m[from]).norm();
    if (length_m >= least_m) lengths_m.insert(1e-4 * std::round(1e4 * length_m));
  }
  return lengths_m;
}

}  // namespace

Library load_library(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw core::MissingError(folder.string() + ": no such folder of CAD models");
  const auto list = folder / "library.yaml";
  Library library;
  for (LibraryPart& part : std::filesystem::exists(list) ? listed_parts(list) : found_parts(folder)) {
    const std::string place = "part '" + part.name + "': ";
    const auto mesh = geometry::load_mesh(part.mesh, part.import);
    if (!mesh && mesh.status().code() == core::ErrorCode::kNotFound)
      throw core::MissingError(place + mesh.status().message());
    if (!mesh) {
      library.unusable.push_back({part.name, place + mesh.status().message()});
      continue;
    }
    survey::PartModel model = survey::make_part(part.name, *mesh);
    if (model.loops.empty()) {
      library.unusable.push_back(
          {part.name,
           place + part.mesh.string() + ": has no plane face with corners; nothing of it can be measured"});
      continue;
    }
    part.notes = mesh->notes;
    library.models.push_back(std::move(model));
    library.parts.push_back(std::move(part));
  }
  if (library.parts.empty())
    throw ConfigError(folder.string() +
                      ": holds no part that can be used; allowed: a library.yaml, or mesh files" +
                      (library.unusable.empty() ? "" : "; " + library.unusable.front().problem));
  return library;
}

std::string parts_text(const Library& library, double apart_m) {
  std::vector<std::set<double>> lengths_m;
  for (const survey::PartModel& model : library.models) lengths_m.push_back(edge_lengths_m(model));
  std::string text;
  for (std::size_t i = 0; i < library.models.size(); ++i) {
    const survey::PartModel& model = library.models[i];
    std::vector<std::string> own_mm;
    for (const double length_m : lengths_m[i]) {
      bool own = true;
      for (std::size_t other = 0; other < lengths_m.size(); ++other) {
        const auto near = lengths_m[other].lower_bound(length_m - apart_m);
        own = own && (other == i || near == lengths_m[other].end() || *near > length_m + apart_m);
      }
      if (own) own_mm.push_back(fmt::format("{:.4g}", 1e3 * length_m));
    }
    const auto box = model.mesh_O.bounding_box();
    const Eigen::Vector3f size_m = box.max_m - box.min_m;
    text += fmt::format("{:<20} {}, {:.2g} : 1, {} plane faces, {}\n", model.name, size_text(model),
                        size_m.maxCoeff() / size_m.minCoeff(), model.faces.size(),
                        own_mm.empty() ? std::string("no length of its own")
                                       : fmt::format("{} mm {} its alone", fmt::join(own_mm, ", "),
                                                     own_mm.size() == 1 ? "is" : "are"));
  }
  return text;
}

std::size_t find_part(const Library& library, const std::string& name) {
  const auto unusable = std::ranges::find(library.unusable, name, &UnusablePart::name);
  if (unusable != library.unusable.end()) throw ConfigError(unusable->problem);
  const LibraryPart& found =
      runtime::find_named(library.parts, name, "part '" + name + "' is not in the library");
  return static_cast<std::size_t>(&found - library.parts.data());
}

}  // namespace phantom::workspace_survey
