#include <numbers>

#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::optional<int> read_auto_count(const ConfigReader& reader, const char* key, Range range) {
  if (!reader.has(key) || reader.text(key) == "auto") return std::nullopt;
  return reader.integer(key, range);
}

SkinSegmentConfig read_segment(const ConfigReader& reader) {
  SkinSegmentConfig segment;
  segment.from_m = reader.vector3("from_m");
  segment.to_m = reader.vector3("to_m");
  segment.from_radius_m = reader.number("from_radius_m", {0, 10, "m"});
  segment.to_radius_m = reader.number("to_radius_m", segment.from_radius_m, {0, 10, "m"});
  segment.sides = read_auto_count(reader, "sides", {3, 10000, "sensors"});
  segment.rings = read_auto_count(reader, "rings", {2, 10000, "rings"});
  segment.spin_rad = reader.number("spin_deg", 0.0, {-360, 360, "degrees"}) * kDegree;
  segment.gain = reader.number("gain", 1.0, {0, 1000, ""});
  if ((segment.to_m - segment.from_m).norm() < 1e-6)
    throw reader.error("to_m", "is the same point as from_m");
  return segment;
}

}  // namespace

ArmConfig read_arm(const ConfigReader& reader) {
  ArmConfig arm;
  arm.name = reader.text("name");
  arm.urdf = reader.path("urdf");
  arm.tip_link = reader.text("tip_link");
  arm.X_WB = reader.pose("mount");
  arm.home = reader.numbers("home");
  if (!std::filesystem::is_regular_file(arm.urdf))
    throw reader.error("urdf", "is not a file (" + arm.urdf.string() + ")");
  for (const auto& link : reader.sections("skin")) {
    LinkSkinConfig skin{link.text("link"), {}};
    for (const auto& segment : link.sections("segments")) skin.segments.push_back(read_segment(segment));
    if (skin.segments.empty()) throw link.error("segments", "is empty; allowed: at least one segment");
    arm.skin.push_back(std::move(skin));
  }
  for (const auto& point : reader.sections("interest_points")) {
    arm.interest_points.push_back({point.text("name"), point.text("link"), point.vector3("position_m")});
  }
  return arm;
}

}  // namespace phantom::runtime
