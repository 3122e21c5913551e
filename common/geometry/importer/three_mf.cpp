#include "common/geometry/importer/three_mf.hpp"

#include <unzip.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "common/core/text.hpp"
#include "common/geometry/importer/xml_tags.hpp"
#include "common/geometry/mesh/mesh_import.hpp"
#include "common/geometry/mesh/vertex_welder.hpp"

namespace phantom::geometry::detail {
namespace {

using Placement = Eigen::Affine3d;

/// Why a package is not read.
struct Refused {
  std::string why;
};

template <class Number>
Number number_of(std::string_view text, const char* what) {
  text = core::trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  Number value{};
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size())
    throw Refused{std::string("has '") + std::string(text.substr(0, 40)) + "' as " + what};
  return value;
}

template <class Number>
Number attribute(const Tag& tag, const char* name) {
  const auto text = tag.find(name);
  if (!text) throw Refused{"has a <" + std::string(tag.name) + "> without '" + name + "'"};
  return number_of<Number>(*text, name);
}

/// Reads twelve numbers, the rows of a matrix that rows of coordinates are multiplied by.
Placement transform_of(const Tag& tag) {
  const auto text = tag.find("transform");
  Placement placement = Placement::Identity();
  if (!text) return placement;
  std::string_view rest = core::trimmed(*text);
  for (int i = 0; i < 12; ++i) {
    const std::size_t end = std::min(rest.find_first_of(" \t\r\n"), rest.size());
    placement.matrix()(i % 3, i / 3) = number_of<double>(rest.substr(0, end), "a number of a transform");
    rest = core::trimmed(rest.substr(end));
  }
  if (!rest.empty()) throw Refused{"has a transform of more than twelve numbers"};
  return placement;
}

// ---- models

/// An object at a place: an item of the build, or a component of an object.
struct Use {
  std::string part;  // the model part that holds it
  std::uint32_t object = 0;
  Placement placement;
};

struct Object {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Use> components;
  std::string type;
};

struct Model {
  std::map<std::uint32_t, Object> objects;
  std::vector<Use> items;
  DeclaredFrame frame;
};

/// Refuses extensions that a reader must know, other than those that leave the shape as it is read here.
void check_extensions(const Tag& model) {
  const auto required = model.find("requiredextensions");
  if (!required) return;
  std::string_view rest = core::trimmed(*required);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find_first_of(" \t\r\n"), rest.size());
    const std::string prefix(rest.substr(0, end));
    const std::string_view name = model.find("xmlns:" + prefix).value_or(prefix);
    const auto is = [&](std::string_view what) { return name.find(what) != std::string_view::npos; };
    if (!is("/production/") && !is("/material/") && !is("/trianglesets/"))
      throw Refused{"requires the 3MF extension " + std::string(name) +
                    ", which is not read: export it without"};
    rest = core::trimmed(rest.substr(end));
  }
}

/// Refuses shapes that are no triangles, whether the file requires them of a reader or not.
void check_shape(const Tag& tag) {
  for (const std::string_view other :
       {"beamlattice", "booleanshape", "booleans", "displacementmesh", "levelset", "implicitfunction"}) {
    if (tag.name == other)
      throw Refused{"has a <" + std::string(tag.name) + ">, whose shape is not read: export it as triangles"};
  }
}

Use use_of(const Tag& tag, const std::string& part) {
  const std::string path(tag.find("path").value_or(part));
  return {path, attribute<std::uint32_t>(tag, "objectid"), transform_of(tag)};
}

Model parse_model(std::string_view text, const std::string& part) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw Refused{"has a model of 16 bits a character (UTF-16), which is not read"};
  Model model;
  Object* object = nullptr;
  bool seen = false;
  Tag tag;
  Tags tags(text);
  while (tags.next(tag)) {
    if (tag.name == "object" && tag.closes && !tag.opens) object = nullptr;
    if (!tag.opens) continue;
    check_shape(tag);
    if (tag.name == "model") {
      seen = true;
      check_extensions(tag);
      model.frame = declared_in_text("3mf", text.substr(0, 1 << 18));
      if (!model.frame.scale) {
        throw Refused{"is in the unit '" + std::string(tag.find("unit").value_or("").substr(0, 40)) +
                      "'; allowed: micron, millimeter, centimeter, inch, foot, meter"};
      }
    } else if (tag.name == "object") {
      const auto id = attribute<std::uint32_t>(tag, "id");
      const auto [made, is_new] = model.objects.try_emplace(id);
      if (!is_new) throw Refused{"has object " + std::to_string(id) + " twice"};
      made->second.type = tag.find("type").value_or("model").substr(0, 40);
      object = tag.closes ? nullptr : &made->second;
    } else if (tag.name == "item") {
      model.items.push_back(use_of(tag, part));
    } else if (object == nullptr) {
      continue;
    } else if (tag.name == "vertex") {
      object->vertices.emplace_back(attribute<double>(tag, "x"), attribute<double>(tag, "y"),
                                    attribute<double>(tag, "z"));
    } else if (tag.name == "triangle") {
      object->triangles.push_back({attribute<std::uint32_t>(tag, "v1"), attribute<std::uint32_t>(tag, "v2"),
                                   attribute<std::uint32_t>(tag, "v3")});
    } else if (tag.name == "component") {
      object->components.push_back(use_of(tag, part));
    }
  }
  if (tags.cut_short()) throw Refused{"has a model that ends within a tag: was it cut short?"};
  if (!seen) throw Refused{"has no <model> in its part " + part};
  for (const auto& [id, one] : model.objects) {
    for (const auto& triangle : one.triangles) {
      if (std::ranges::max(triangle) >= one.vertices.size())
        throw Refused{"has a triangle that names a vertex which does not exist, in object " +
                      std::to_string(id)};
    }
  }
  return model;
}

// ---- the package

class Package {
 public:
  explicit Package(const std::filesystem::path& path) : archive_(unzOpen(path.c_str()), unzClose) {
    if (!archive_) throw Refused{"is not a 3MF package: it is no ZIP archive, or was cut short"};
    root_ = with_slash(root_model_of_3mf(member("_rels/.rels").value_or("")));
    if (root_ == "/") root_ = first_model();
  }

  const Model& root() { return model(root_); }
  const Model& model(const std::string& part) {
    const std::string name = with_slash(part);
    const auto known = models_.find(name);
    if (known != models_.end()) return known->second;
    const auto text = member(name.substr(1));
    if (!text) throw Refused{"has no model part " + name + ", which is to be built"};
    Model made = parse_model(*text, name);
    if (name != root_ && made.frame.scale != root().frame.scale)
      throw Refused{"has model parts in different units: " + name + " and " + root_};
    return models_.emplace(name, std::move(made)).first->second;
  }

 private:
  static std::string with_slash(const std::string& name) { return name.starts_with('/') ? name : "/" + name; }

  std::optional<std::string> member(const std::string& name) {
    constexpr int kAnyCase = 2;  // of minizip; names of parts are equal in any case
    if (unzLocateFile(archive_.get(), name.c_str(), kAnyCase) != UNZ_OK) return {};
    if (unzOpenCurrentFile(archive_.get()) != UNZ_OK)
      throw Refused{"has a member that is not readable: " + name};
    std::string text, block(1 << 16, '\0');
    for (;;) {
      const int count = unzReadCurrentFile(archive_.get(), block.data(), static_cast<unsigned>(block.size()));
      if (count < 0) throw Refused{"has a member that is damaged: " + name};
      if (count == 0) break;
      text.append(block, 0, static_cast<std::size_t>(count));
    }
    if (unzCloseCurrentFile(archive_.get()) == UNZ_CRCERROR)
      throw Refused{"has a member that is damaged (its checksum is wrong): " + name};
    return text;
  }
  std::string first_model() {
    for (int at = unzGoToFirstFile(archive_.get()); at == UNZ_OK; at = unzGoToNextFile(archive_.get())) {
      char name[512] = {};
      unz_file_info info{};  // minizip 1.1 writes to it even if not requested
      if (unzGetCurrentFileInfo(archive_.get(), &info, name, sizeof name - 1, nullptr, 0, nullptr, 0) ==
              UNZ_OK &&
          std::string_view(name).ends_with(".model"))
        return with_slash(name);
    }
    throw Refused{"is not a 3MF package: it has no model"};
  }

  std::unique_ptr<void, int (*)(void*)> archive_;
  std::string root_;
  std::map<std::string, Model> models_;
};

/// Visits every triangle of what the package builds, in the root model's units. Outward stays outward.
template <class Visit>
class Builder {
 public:
  /// Adds to `other_types` which objects are built that are no model, such as a printer's supports.
  Builder(Package& package, const Visit& visit, std::set<std::string>& other_types)
      : package_(package), visit_(visit), other_types_(other_types) {}

  void place(const Use& use, const Placement& outer, int depth) {
    constexpr int kDeepest = 32, kMaxUses = 1'000'000;
    const std::string name = "object " + std::to_string(use.object) + " of its part " + use.part;
    if (depth > kDeepest) throw Refused{"has components within components without end, by " + name};
    if (++uses_ > kMaxUses) throw Refused{"has more than " + std::to_string(kMaxUses) + " components"};
    const auto& objects = package_.model(use.part).objects;
    const auto found = objects.find(use.object);
    if (found == objects.end()) throw Refused{"builds " + name + ", which is not there"};
    const Object& object = found->second;
    if (object.type != "model") other_types_.insert("its " + name + " is of type '" + object.type + "'");
    const Placement here = outer * use.placement;
    const bool mirrored = here.linear().determinant() < 0.0;
    for (const auto& [a, b, c] : object.triangles) {
      visit_(here * object.vertices[a], here * object.vertices[mirrored ? c : b],
             here * object.vertices[mirrored ? b : c]);
    }
    for (const Use& component : object.components) place(component, here, depth + 1);
  }

 private:
  Package& package_;
  const Visit& visit_;
  std::set<std::string>& other_types_;
  int uses_ = 0;
};

/// Calls visit(corner, corner, corner) for every triangle of the build. Returns which objects are no model.
template <class Visit>
std::set<std::string> for_each_built(Package& package, const Visit& visit) {
  std::set<std::string> other_types;
  Builder<Visit> builder(package, visit, other_types);
  for (const Use& item : package.root().items) builder.place(item, Placement::Identity(), 0);
  return other_types;
}

std::array<double, 3> extents_of(Package& package) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  for_each_built(package, [&](const auto&... corner) {
    ((low = low.cwiseMin(corner), high = high.cwiseMax(corner)), ...);
  });
  const Eigen::Vector3d extent = low.x() <= high.x() ? Eigen::Vector3d(high - low) : Eigen::Vector3d::Zero();
  return {extent.x(), extent.y(), extent.z()};
}

}  // namespace

bool import_3mf(const std::filesystem::path& path, const MeshImportOptions& options, LoadedMesh& mesh,
                std::string& problem) {
  try {
    Package package(path);
    if (package.root().items.empty()) throw Refused{"builds nothing: its <build> has no items"};
    resolve_frame(
        options, "3mf Importer", package.root().frame, [&] { return extents_of(package); }, mesh);
    const Eigen::Matrix3d to_metres = mesh.scale * to_z_up(mesh.up);
    VertexWelder corners(mesh);
    std::uint64_t left = options.max_triangles;
    const auto vertex = [&](const Eigen::Vector3d& p) {
      return corners.vertex((to_metres * p).cast<float>());
    };
    const auto others = for_each_built(package, [&](const auto& a, const auto& b, const auto& c) {
      if (left-- == 0) throw Refused{too_many_triangles(options)};
      corners.triangle({vertex(a), vertex(b), vertex(c)});
    });
    for (const std::string& other : others) mesh.notes.push_back(other + ", and counts");
    return finish_import(corners.finite(), corners.collapsed(), mesh, problem);
  } catch (const Refused& refused) {
    problem = refused.why;
    return false;
  }
}

}  // namespace phantom::geometry::detail
