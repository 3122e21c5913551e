#include "components/synthetic_viewer/scene/picks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/process/command_line.hpp"
#include "components/synthetic_viewer/render/feature_edges.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr float kNearPoint_m = 0.02F;

core::Status bad_pick(const std::string& text, const std::string& why) {
  return core::Status::invalid_argument("--pick " + text + ": " + why);
}

/// Returns the numbers of "1,2,3"; nothing if there are not `count` of them.
std::optional<std::vector<double>> numbers_of(const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto number = runtime::number_of(text.substr(begin, end - begin));
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

/// Returns the vertex nearest to a point if it is within `reach_m`.
std::optional<Eigen::Vector3f> corner_near(const geometry::TriangleMesh& mesh, const Eigen::Vector3f& point_m,
                                           float reach_m) {
  const auto distance = [&](const Eigen::Vector3f& v) { return (v - point_m).norm(); };
  const auto nearest = std::ranges::min_element(mesh.vertices_m, {}, distance);
  if (nearest == mesh.vertices_m.end() || distance(*nearest) > reach_m) return std::nullopt;
  return *nearest;
}

core::Expected<Eigen::Vector3d> corner_of_object(const std::string& text, const std::string& name,
                                                 const std::string& which, const runtime::CellConfig& cell) {
  const auto object = std::ranges::find(cell.objects, name, &runtime::ObjectConfig::name);
  if (object == cell.objects.end()) return bad_pick(text, "the cell has no object '" + name + "'");
  const geometry::TriangleMesh mesh_O = runtime::load_body(*object, cell).mesh_O;
  if (which.size() == 3 && which.find_first_not_of("+-") == std::string::npos) {
    const auto corner_m =
        corner_towards(edges_of(mesh_O), {which[0] == '+', which[1] == '+', which[2] == '+'});
    if (!corner_m) return bad_pick(text, name + " has no sharp corner on that side; allowed: x,y,z of one");
    return Eigen::Vector3d(object->X_WO * corner_m->cast<double>());
  }
  const auto place = numbers_of(which, 3);
  if (!place)
    return bad_pick(
        text,
        "'" + which + "' is no corner; allowed: x,y,z in the object's frame, or three signs such as +-+");
  const auto corner_m =
      corner_near(mesh_O, Eigen::Vector3d((*place)[0], (*place)[1], (*place)[2]).cast<float>(), kNearPoint_m);
  if (!corner_m)
    return bad_pick(text,
                    fmt::format("{} has no corner within {:.0f} mm of there", name, 1e3F * kNearPoint_m));
  return Eigen::Vector3d(object->X_WO * corner_m->cast<double>());
}

}  // namespace

core::Expected<camera::SeenPoint> parse_pick(const std::string& text, const runtime::CellConfig* cell) {
  const std::size_t equals = text.find('=');
  const auto pixel = numbers_of(text.substr(0, equals), 2);
  if (equals == std::string::npos || !pixel)
    return bad_pick(text, "allowed: u,v=x,y,z or u,v=OBJECT:x,y,z or u,v=OBJECT:+-+");
  const std::string place = text.substr(equals + 1);
  camera::SeenPoint point;
  point.pixel = {(*pixel)[0], (*pixel)[1]};
  if (const auto numbers = numbers_of(place, 3)) {
    point.position_W_m = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
    return point;
  }
  const std::size_t colon = place.rfind(':');
  if (colon == std::string::npos)
    return bad_pick(text, "'" + place + "' is neither a point of W nor OBJECT:corner");
  if (cell == nullptr) return bad_pick(text, "an object's corner needs --cell");
  const auto position = corner_of_object(text, place.substr(0, colon), place.substr(colon + 1), *cell);
  if (!position) return position.status();
  point.position_W_m = *position;
  return point;
}

}  // namespace phantom::synthetic_viewer
