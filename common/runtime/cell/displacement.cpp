#include "common/runtime/cell/displacement.hpp"

#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/core/errors.hpp"
#include "common/geometry/mesh/solid_moments.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/voxelise/solid_pieces.hpp"

namespace phantom::runtime {
namespace {

using robot::DisplacedPart;
using Parts = std::vector<DisplacedPart>;

std::string place_of_link(const ArmConfig& config, const std::string& link) {
  return config.file.string() + ": arm '" + config.name + "': displaced: link '" + link + "' ";
}

/// What the visuals of a moving link enclose, in its frame.
Parts enclosed_by_visuals(const ArmConfig& config, const robot::Link& link) {
  geometry::TriangleMesh whole;
  for (const robot::LinkMesh& visual : link.meshes) {
    const auto mesh = robot::load_mesh(visual);
    if (!mesh) throw core::MissingError(place_of_link(config, link.name) + mesh.status().message());
    whole.append(mesh->transformed(visual.X_link_mesh));
  }
  const auto solid = voxelise::solid_pieces(whole);
  if (!solid) throw core::ConfigError(place_of_link(config, link.name) + solid.status().message());
  Parts parts;
  for (const voxelise::SolidPiece& piece : solid->pieces)
    parts.push_back({piece.centre_m, piece.volume_m3, piece.cell_m});
  if (!solid->closed && !parts.empty())
    spdlog::warn("{}has open visuals; what it displaces is that with their holes closed",
                 place_of_link(config, link.name));
  return parts;
}

struct Sum {
  double volume_m3 = 0.0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
};
Sum sum_of(const Parts& parts) {
  Sum sum;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const DisplacedPart& part : parts) {
    sum.volume_m3 += part.volume_m3;
    first += part.volume_m3 * part.centre_m;
  }
  if (sum.volume_m3 > 0.0) sum.centre_m = first / sum.volume_m3;
  return sum;
}

/// The parts with the volume that is stated, about the centre that is stated; without parts, a cube there.
Parts as_stated(const DisplacedLinkConfig& stated, const geometry::Pose& X_link_frame, Parts parts) {
  const Sum sum = sum_of(parts);
  if (stated.volume_m3 == 0.0) return {};
  const Eigen::Vector3d centre_m =
      stated.centre_m ? Eigen::Vector3d(X_link_frame * *stated.centre_m) : sum.centre_m;
  if (parts.empty()) return {{centre_m, stated.volume_m3, std::cbrt(stated.volume_m3)}};
  for (DisplacedPart& part : parts) {
    part.volume_m3 *= stated.volume_m3 / sum.volume_m3;
    part.centre_m += centre_m - sum.centre_m;
  }
  return parts;
}

}  // namespace

robot::Buoyancy load_buoyancy(const CellConfig& cell, const ArmConfig& config, const robot::SerialArm& arm) {
  const robot::Medium medium(cell.media.begin(), cell.media.end());
  std::array<const DisplacedLinkConfig*, core::kMaxJoints + 1> stated{};
  std::array<geometry::Pose, core::kMaxJoints + 1> X_link_frame;
  for (const DisplacedLinkConfig& one : config.displaced) {
    const auto frame = arm.find_frame(one.link);
    if (!frame || frame->first == 0)
      throw core::ConfigError(place_of_link(config, one.link) + "is none that moves; allowed: a moving link");
    if (stated[frame->first] != nullptr)
      throw core::ConfigError(place_of_link(config, one.link) + "moves as one with '" +
                              stated[frame->first]->link + "'; allowed: one of the two, for both");
    stated[frame->first] = &one;
    X_link_frame[frame->first] = frame->second;
  }
  if (!robot::Buoyancy({}, medium).acts()) return {};
  robot::DisplacedParts parts;
  for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
    parts[link] = enclosed_by_visuals(config, arm.links()[link]);
    if (stated[link] != nullptr)
      parts[link] = as_stated(*stated[link], X_link_frame[link], std::move(parts[link]));
    else if (parts[link].empty() && arm.links()[link].mass_kg > 0.0)
      throw core::ConfigError(
          place_of_link(config, arm.links()[link].name) +
          "has mass but no visual that encloses anything, in a cell whose media have a density; "
          "allowed: its volume, or 0 for a link that stays in air");
    spdlog::info("arm '{}': {} displaces {:.3g} l of the medium that it is in", config.name,
                 arm.links()[link].name, 1e3 * sum_of(parts[link]).volume_m3);
  }
  return {std::move(parts), medium};
}

std::map<std::uint16_t, double> object_volumes_m3(const CellConfig& cell) {
  std::map<std::uint16_t, double> volumes;
  for (const ObjectConfig& object : cell.objects)
    volumes[object.id] = geometry::solid_moments(load_body(object, cell).mesh_O).volume_m3;
  return volumes;
}

}  // namespace phantom::runtime
