#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Another arm of the cell that this one senses as it moves: each of its links is a body with layers of fluid
/// in its own frame. They are made once, at the start; as the arm moves, this one's sensors are looked up in
/// the links' frames, so nothing is activated anew and no voxel is older than the state.
class OtherArm {
 public:
  /// Id of the first one's fluid; those of further ones follow. Objects of a cell have the low numbers.
  static constexpr std::uint16_t kFirstId = runtime::kFirstOtherArmId;

  /// The parts of each link, base included; without any, no fluid.
  OtherArm(std::string name, std::string partition, std::uint16_t id, robot::SerialArm arm,
           std::vector<workspace::Workspace> fluids);

  const std::string& name() const noexcept { return name_; }
  const std::string& partition() const noexcept { return partition_; }
  std::uint16_t id() const noexcept { return id_; }
  const robot::SerialArm& arm() const noexcept { return arm_; }
  std::size_t link_count() const noexcept { return links_.size(); }
  /// Writes where its links are, and how they move; `links` has link_count() elements. Real-time safe: yes.
  void put(const core::JointArray& position, const core::JointArray& velocity,
           std::span<OtherLink> links) const noexcept;

 private:
  struct Link {
    std::size_t index;
    workspace::Workspace fluid;
    double greatest_neighbour_mu;
  };
  std::string name_, partition_;
  std::uint16_t id_;
  robot::SerialArm arm_;
  std::vector<Link> links_;  // those with fluid
};

/// Loads the arms of config.other_arms and activates their links by the cell's profile. Throws ConfigError
/// naming the file, the arm and what is allowed: an arm of the cell, not this one, each once, with links that
/// are seen (a URDF's visuals), no more than kMaxOtherLinks in all.
std::vector<OtherArm> load_other_arms(const runtime::CellConfig& cell, const Config& config);
/// Returns the number of links of all of them.
std::size_t links_of(const std::vector<OtherArm>& others);

}  // namespace phantom::phantom_sensing
