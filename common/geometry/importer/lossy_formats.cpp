#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/number_text.hpp"
#include "common/core/text.hpp"
#include "common/geometry/importer/importer.hpp"
#include "common/geometry/importer/polygons.hpp"
#include "common/geometry/importer/xml_tags.hpp"
#include "common/geometry/mesh/mesh_import.hpp"

namespace phantom::geometry::detail {
namespace {

/// Calls visit(tag) for each tag.
template <class Visit>
void for_each_tag(std::string_view text, const Visit& visit) {
  Tag tag;
  for (Tags tags(text); tags.next(tag);) visit(tag);
}

std::string amf(std::string_view text) {
  std::string problem;
  int volumes = 0;
  for_each_tag(text, [&](const Tag& tag) {
    if (!tag.opens) return;
    if (tag.name == "mesh") volumes = 0;
    if (tag.name == "volume" && ++volumes == 2)
      problem =
          "has a mesh of several volumes, of which its importer reads one; allowed: one volume to a mesh";
  });
  return problem;
}

std::string x3d(std::string_view text) {
  static const std::set<std::string_view> kLeftOut{"Anchor", "Billboard", "Collision", "LOD",
                                                   "ProtoInstance"};
  std::string problem;
  for_each_tag(text, [&](const Tag& tag) {
    if (!problem.empty() || !tag.opens) return;
    if (kLeftOut.contains(tag.name))
      problem = "has a node " + std::string(tag.name) +
                ", of which its importer leaves the shapes out; allowed: shapes in Transform and Group";
    if (tag.name != "unit" || tag.find("category") != "length") return;
    const std::string_view factor = tag.find("conversionFactor").value_or("1");
    if (core::number_of(core::trimmed(factor)) != 1.0)
      problem = "declares a unit of " + std::string(factor) +
                " m, which its importer does not heed; allowed: a length of 1 m";
  });
  return problem;
}

/// Names a node that places itself by way of others.
class NodeCycle {
 public:
  void places(std::string_view from, std::string_view to) { placed_[from].insert(to); }
  std::string_view found() {
    for (const auto& [node, placed] : placed_)
      if (leads_back(node)) return node;
    return {};
  }

 private:
  bool leads_back(std::string_view start) {
    std::set<std::string_view> seen;
    std::vector<std::string_view> left(placed_[start].begin(), placed_[start].end());
    while (!left.empty()) {
      const std::string_view node = left.back();
      left.pop_back();
      if (node == start) return true;
      if (!seen.insert(node).second) continue;
      if (const auto found = placed_.find(node); found != placed_.end())
        left.insert(left.end(), found->second.begin(), found->second.end());
    }
    return false;
  }
  std::map<std::string_view, std::set<std::string_view>> placed_;
};

/// Whether a skin is moved before its bones move it.
bool moves_a_skin(std::string_view text) {
  constexpr std::string_view kOpen = "bind_shape_matrix>";
  for (std::size_t at = text.find(kOpen); at != std::string_view::npos; at = text.find(kOpen, at + 1)) {
    std::string_view rest = text.substr(at + kOpen.size(), text.find('<', at) - at - kOpen.size());
    for (int i = 0; i < 16; ++i) {
      rest = core::trimmed(rest);
      const std::size_t end = std::min(rest.find_first_of(" \t\r\n"), rest.size());
      const auto number = core::number_of(rest.substr(0, end));
      if (end == 0 || !number) break;  // an end tag
      if (std::abs(*number - (i % 5 == 0 ? 1.0 : 0.0)) > 1e-9) return true;
      rest.remove_prefix(end);
    }
  }
  return false;
}

/// Returns why a tag that places a shape is not carried out; empty: it is.
std::string misplaced(const Tag& tag, const std::set<std::string_view>& ids) {
  const std::string_view url = tag.find("url").value_or("");
  if (!url.starts_with('#'))
    return "places '" + std::string(url) + "' of another file (" + std::string(tag.name) +
           "), which its importer leaves out; allowed: shapes of its own";
  if (ids.contains(url.substr(1))) return "";
  return "places '" + std::string(url.substr(1)) + "' (" + std::string(tag.name) +
         "), which it does not have; allowed: an id of the file";
}

std::string collada(std::string_view text) {
  static const std::set<std::string_view> kShapes{"instance_geometry", "instance_controller",
                                                  "instance_node"};
  std::set<std::string_view> ids;
  for_each_tag(text, [&](const Tag& tag) {
    if (const auto id = tag.find("id")) ids.insert(*id);
  });
  std::string problem;
  NodeCycle cycle;
  std::vector<std::string_view> open;  // nodes by id
  for_each_tag(text, [&](const Tag& tag) {
    if (tag.name == "node" && tag.opens) open.push_back(tag.find("id").value_or(""));
    if (tag.name == "node" && tag.closes && !open.empty()) open.pop_back();
    if (!problem.empty() || !tag.opens) return;
    if (tag.name == "skew")
      problem = "has a <skew>, which its importer cannot read; allowed: translate, rotate, scale, matrix";
    if (const auto meter = tag.name == "unit" ? tag.find("meter") : std::nullopt) {
      const auto scale = core::number_of(core::trimmed(*meter));
      if (!scale || !std::isfinite(*scale) || *scale <= 0.0)
        problem = "declares a unit of '" + std::string(*meter) + "' m; allowed: more than 0";
    }
    if (!kShapes.contains(tag.name)) return;
    problem = misplaced(tag, ids);
    if (problem.empty() && tag.name == "instance_node" && !open.empty() && !open.back().empty())
      cycle.places(open.back(), tag.find("url")->substr(1));
  });
  if (problem.empty() && moves_a_skin(text))
    problem = "has a skin with a bind_shape_matrix, which its importer does not apply; allowed: the identity";
  if (problem.empty() && !cycle.found().empty())
    problem = "has a node '" + std::string(cycle.found()) + "' that is a part of itself";
  return problem;
}

/// Reads a DXF's pairs of a code and a value.
std::string dxf(std::string_view text) {
  std::string entity, problem;
  while (problem.empty() && !text.empty()) {
    const std::string_view key = core::trimmed(take_line(text)), what = core::trimmed(take_line(text));
    if (key == "0") {
      entity = what;
      if (what == "3DSOLID" || what == "BODY" || what == "REGION")
        problem = "has a " + entity + ", which its importer leaves out; allowed: meshes and 3D faces";
      continue;
    }
    if (entity != "INSERT") continue;
    const double number = core::number_of(what).value_or(0.0);
    const bool turned = key == "50" && number != 0.0,
               scaled = (key == "41" || key == "42" || key == "43") && number != 1.0,
               repeated = (key == "70" || key == "71") && number > 1.0;
    if (turned || scaled || repeated)
      problem = std::string("places a block that is ") +
                (turned   ? "turned"
                 : scaled ? "scaled"
                          : "repeated") +
                " (INSERT), which its importer does not heed; allowed: blocks that are exploded";
  }
  return problem;
}

}  // namespace

std::string check_lossy_format(const std::filesystem::path& path) {
  const std::string ending = extension_of(path);
  static const std::map<std::string, std::string (*)(std::string_view), std::less<>> kChecks{
      {"amf", amf}, {"x3d", x3d}, {"dae", collada}, {"dxf", dxf}};
  const auto check = kChecks.find(ending);
  if (check == kChecks.end()) return "";
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return check->second(text);
}

}  // namespace phantom::geometry::detail
