#include "components/synthetic_viewer/stream/fluid_store.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <regex>
#include <string_view>
#include <utility>

#include "components/synthetic_viewer/scene/mesh_store.hpp"

namespace phantom::synthetic_viewer {
namespace {

using workspace::ObjectFluid;
using workspace::VoxelBox;
using workspace::Workspace;

core::Status too_large(const std::string& what, std::size_t most) {
  return {core::ErrorCode::kResourceExhausted,
          fmt::format("{}; at most {} are shown: choose one object, or a smaller one", what, most)};
}

/// Appends numbers of 32 bits, little endian.
template <class... Number>
void append_numbers(std::string& to, Number... numbers) {
  static_assert(std::endian::native == std::endian::little && ((sizeof(Number) == 4) && ...));
  (to.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
}

/// Begins an answer with where its voxels are: origin and sides, m.
std::string placed(const workspace::GridSpec& grid) {
  std::string octets;
  for (const Eigen::Vector3d& vector : {grid.origin_m, grid.voxel_size_m.sides_m()})
    for (const double along_axis_m : vector) append_numbers(octets, static_cast<float>(along_axis_m));
  return octets;
}

/// Returns the fluid of all objects together, and that of each.
std::vector<ObjectFluid> with_every(std::vector<ObjectFluid> fluids) {
  ObjectFluid every;
  for (const ObjectFluid& fluid : fluids) {
    every.box = every.box.hull(fluid.box);
    for (const auto& [order, code] : fluid.mu_code) {
      std::uint8_t& greatest = every.mu_code[order];
      greatest = std::max(greatest, code);
    }
  }
  fluids.insert(fluids.begin(), std::move(every));
  return fluids;
}

std::string described(const Workspace& of, const std::vector<ObjectFluid>& fluids, std::size_t most) {
  const Eigen::Vector3d &origin_m = of.grid().origin_m, &sides_m = of.grid().voxel_size_m.sides_m();
  std::string text = fmt::format(
      R"({{"version":{},"origin_m":[{}],"voxel_size_m":[{}],"left_out":{},"objects":[)", of.version,
      fmt::join(origin_m, ","), fmt::join(sides_m, ","), fluids.size() - std::min(most, fluids.size()));
  for (std::size_t i = 0; i < std::min(most, fluids.size()); ++i) {
    const auto& [object, box, mu_code] = fluids[i];
    text += fmt::format(R"({}{{"object":{},"min_vox":[{},{},{}],"size_vox":[{},{},{}],"layers":[)",
                        i > 0 ? "," : "", object, box.min.x, box.min.y, box.min.z, box.size[0], box.size[1],
                        box.size[2]);
    bool first = true;
    for (const auto& [order, code] : mu_code) {
      text += fmt::format("{}[{},{}]", first ? "" : ",", order, of.palette()[code]);
      first = false;
    }
    text += "]}";
  }
  return text + "]}";
}

core::Expected<std::string> packed_shell(const Workspace& of, const ObjectFluid& fluid, int order) {
  // Of a wider type than orders have, lest another one be found.
  if (std::ranges::none_of(fluid.mu_code, [order](const auto& layer) { return layer.first == order; }))
    return core::Status::not_found(fmt::format("object {} has no layer {}", fluid.object, order));
  const auto faces = workspace::shell_of(of, fluid.box, fluid.object, static_cast<std::int8_t>(order),
                                         FluidStore::kMaxFaces);
  if (!faces) return too_large(faces.status().message(), FluidStore::kMaxFaces);
  std::string octets = placed(of.grid());
  append_numbers(octets, static_cast<std::uint32_t>(faces->size()), std::uint32_t{0});
  octets.append(reinterpret_cast<const char*>(faces->data()), faces->size() * sizeof faces->front());
  return octets;
}

core::Expected<std::string> packed_section(const Workspace& of, const ObjectFluid& fluid, std::size_t axis,
                                           std::int32_t at) {
  const VoxelBox& box = fluid.box;
  const std::int32_t end = box.end()[axis];
  if (at < box.min[axis] || at >= end)
    return core::Status::not_found(
        fmt::format("the fluid lies at {} to {} along this axis, not at {}", box.min[axis], end - 1, at));
  const std::size_t along = (axis + 1) % 3, across = (axis + 2) % 3;
  const std::size_t cells =
      static_cast<std::size_t>(box.size[along]) * static_cast<std::size_t>(box.size[across]);
  if (cells > FluidStore::kMaxCells)
    return too_large(fmt::format("the section has {} cells", cells), FluidStore::kMaxCells);
  const std::vector<std::int8_t> orders = workspace::section_of(of, box, fluid.object, axis, at);
  std::string octets = placed(of.grid());
  append_numbers(octets, static_cast<std::uint32_t>(axis), at, box.min[along], box.min[across],
                 box.size[along], box.size[across]);
  octets.append(reinterpret_cast<const char*>(orders.data()), orders.size());
  return octets;
}

/// Makes what one of FluidStore::kPaths asks for, before it is packed.
core::Expected<std::string> made_of(const Workspace& of, const std::vector<ObjectFluid>& fluids,
                                    const std::string& path) {
  static const std::regex paths(FluidStore::kPaths);
  std::smatch words;
  if (!std::regex_match(path, words, paths)) return core::Status::not_found("unknown path");
  const bool shell = words[1].matched;
  if (!shell && !words[4].matched) return described(of, fluids, FluidStore::kMaxObjects);
  const int object = std::stoi(words[shell ? 2 : 5]);
  const auto found =
      std::ranges::find_if(fluids, [object](const ObjectFluid& fluid) { return fluid.object == object; });
  if (found == fluids.end() || found->box.empty())
    return core::Status::not_found(fmt::format("object {} has no fluid in the workspace", object));
  if (const std::size_t bricks = workspace::bricks_of(found->box).voxel_count();
      bricks > FluidStore::kMaxBricks)
    return too_large(fmt::format("it reaches over {} bricks of voxels", bricks), FluidStore::kMaxBricks);
  if (shell) return packed_shell(of, *found, std::stoi(words[3]));
  return packed_section(of, *found, static_cast<std::size_t>(words[6].str()[0] - 'x'), std::stoi(words[7]));
}

}  // namespace

core::Expected<FluidStore::Content> FluidStore::content() {
  const auto newest = find_ ? find_() : nullptr;
  if (!newest)
    return core::Status(core::ErrorCode::kUnavailable, "the workspace has not come yet as a whole");
  const std::lock_guard lock(mutex_);
  if (of_.lock() != newest || version_ != newest->version) {
    fluids_ = std::make_shared<const std::vector<ObjectFluid>>(with_every(workspace::fluids_of(*newest)));
    of_ = newest;
    version_ = newest->version;
    kept_.clear();
    kept_octets_ = 0;
  }
  return Content{newest, fluids_};
}

FluidStore::Answer FluidStore::kept(const std::string& path, const Content& content) {
  const auto is_newest = [&] {
    return of_.lock() == content.workspace && version_ == content.workspace->version;
  };
  {
    const std::lock_guard lock(mutex_);
    const auto known = kept_.find(path);
    if (known != kept_.end() && is_newest()) return known->second;
  }
  const auto made = made_of(*content.workspace, *content.fluids, path);
  if (!made) return made.status();
  const Found found{std::make_shared<const std::string>(gzip(*made)),
                    '"' + hash_text(std::hash<std::string_view>()(*made)) + '"',
                    path == "/fluid" ? "application/json" : "application/octet-stream"};
  const std::lock_guard lock(mutex_);
  if (!is_newest()) return found;
  if (kept_octets_ + found.octets->size() > kMaxKept) kept_.clear(), kept_octets_ = 0;
  if (kept_.emplace(path, found).second) kept_octets_ += found.octets->size();
  return found;
}

FluidStore::Answer FluidStore::find(const std::string& path) {
  struct Place {
    std::atomic<int>& asking;
    const bool free = asking.fetch_add(1) < kMaxAtOnce;
    ~Place() { asking.fetch_sub(1); }
  } const place{asking_};
  if (!place.free)
    return core::Status(core::ErrorCode::kUnavailable, "others are looking at the fluid: ask again");
  const auto now = content();
  if (!now) return now.status();
  return kept(path, *now);
}

}  // namespace phantom::synthetic_viewer
