#include "common/messages/codecs/living_codec.hpp"

#include <unordered_set>

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

constexpr double kMaxEdge_px = 4096.0, kLeast = 1e-6, kMaxFocal_px = 1e5, kMaxRange_m = 100.0;
constexpr double kMaxAge_s = 10.0, kMaxSilence_s = 1e9, kMaxRate_hz = 1e4;
constexpr double kMaxSize_vox = 8192.0, kLastBlock = 1023.0;

constexpr auto kDepthImage = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.name("camera", m.camera(), s.camera);
  codec.number("age_s", m.age_s(), s.age_s, 0.0, kMaxAge_s);
  codec.number("width", m.width(), s.width, 1.0, kMaxEdge_px);
  codec.number("height", m.height(), s.height, 1.0, kMaxEdge_px);
  codec.number("fx_px", m.fx_px(), s.fx_px, kLeast, kMaxFocal_px);
  codec.number("fy_px", m.fy_px(), s.fy_px, kLeast, kMaxFocal_px);
  codec.number("cx_px", m.cx_px(), s.cx_px, -kMaxFocal_px, kMaxFocal_px);
  codec.number("cy_px", m.cy_px(), s.cy_px, -kMaxFocal_px, kMaxFocal_px);
  codec.number("min_depth_m", m.min_depth_m(), s.min_depth_m, kLeast, kMaxRange_m);
  codec.number("max_depth_m", m.max_depth_m(), s.max_depth_m, kLeast, kMaxRange_m);
};

constexpr auto kBlock = [](auto& codec, auto& m, auto& s) {
  codec.number("blocks.x", m.x(), s.x, 0.0, kLastBlock);
  codec.number("blocks.y", m.y(), s.y, 0.0, kLastBlock);
  codec.number("blocks.z", m.z(), s.z, 0.0, kLastBlock);
  codec.any(m.bits(), s.bits);
};

constexpr auto kCamera = [](auto& codec, auto& m, auto& s) {
  codec.name("cameras.name", m.name(), s.name);
  codec.enumeration("cameras.state", m.state(), s.state, DepthCameraState::kDead);
  codec.number("cameras.age_s", m.age_s(), s.age_s, 0.0, kMaxSilence_s);
  codec.number("cameras.rate_hz", m.rate_hz(), s.rate_hz, 0.0, kMaxRate_hz);
};

void take_edge(Decoder& codec, double from, workspace::VoxelSize& to) {
  double edge_m = 0.0;
  codec.number("voxel_size_m", from, edge_m, kLeast, kFarthest_m);
  to = workspace::VoxelSize(edge_m);
}
void take_edge(Encoder& codec, double& to, const workspace::VoxelSize& from) {
  codec.number("voxel_size_m", to, from.reference_m());
}

constexpr auto kOccupancyChange = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.name("source", m.source(), s.source);
  codec.name("cell", m.cell(), s.cell);
  codec.place("origin_m", m.origin_m(), s.grid.origin_m);
  auto&& edge_m = m.voxel_size_m();
  take_edge(codec, edge_m, s.grid.voxel_size_m);
  codec.number("size_x_vox", m.size_x_vox(), s.grid.size_vox[0], 1.0, kMaxSize_vox);
  codec.number("size_y_vox", m.size_y_vox(), s.grid.size_vox[1], 1.0, kMaxSize_vox);
  codec.number("size_z_vox", m.size_z_vox(), s.grid.size_vox[2], 1.0, kMaxSize_vox);
  codec.any(m.whole(), s.whole);
  codec.number("image_age_s", m.image_age_s(), s.image_age_s, -1.0, kMaxSilence_s);
  codec.list(m.blocks(), s.blocks, kBlock, kMaxOccupancyBlocks);
  codec.list(m.cameras(), s.cameras, kCamera, kMaxDepthCameras);
};

/// Returns why the image's fields do not fit together; empty if they do.
std::string refusal(const DepthImage& image) {
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  if (pixels > kMaxDepthPixels)
    return "width·height is " + std::to_string(pixels) + "; allowed: at most " +
           std::to_string(kMaxDepthPixels);
  if (image.max_depth_m <= image.min_depth_m)
    return "max_depth_m is not above min_depth_m; allowed: more than that";
  return "";
}

/// Returns why a block does not fit; empty if each does. A block's voxels beyond the grid must be free.
std::string refusal(const OccupancyChange& change) {
  std::unordered_set<std::uint64_t> known;
  known.reserve(change.blocks.size());
  const auto& size = change.grid.size_vox;
  for (const OccupancyBlock& block : change.blocks) {
    const std::uint64_t place =
        std::uint64_t{block.x} << 32 | std::uint64_t{block.y} << 16 | std::uint64_t{block.z};
    const auto name = [&] {
      return "block (" + std::to_string(block.x) + ", " + std::to_string(block.y) + ", " +
             std::to_string(block.z) + ")";
    };
    if (!known.insert(place).second) return name() + " comes twice; allowed: each once";
    if (8 * block.x >= size[0] || 8 * block.y >= size[1] || 8 * block.z >= size[2])
      return name() + " is not in the grid; allowed: those that have a voxel of it";
    for (std::int32_t z = 0; z < 8; ++z) {
      for (std::int32_t y = 0; y < 8; ++y) {
        const auto row = static_cast<unsigned>(block.bits[static_cast<std::size_t>(z)] >> (8 * y) & 0xFF);
        if (row == 0) continue;
        const std::int32_t columns = size[0] - 8 * block.x;
        if (8 * block.z + z >= size[2] || 8 * block.y + y >= size[1] || (columns < 8 && row >> columns != 0))
          return name() + " has occupied voxels beyond the grid; allowed: none there";
      }
    }
  }
  return "";
}

}  // namespace

const char* name_of(DepthCameraState state) noexcept {
  switch (state) {
    case DepthCameraState::kWaiting:
      return "waiting";
    case DepthCameraState::kLive:
      return "live";
    case DepthCameraState::kLate:
      return "late";
    case DepthCameraState::kDead:
      return "dead";
  }
  return "?";
}

core::Expected<DepthImage> from_idl(const msg::DepthImage& message, const ArmBounds& arm) {
  auto image = decoded<DepthImage>(kDepthImage, message, arm);
  if (!image) return image;
  if (const std::string why = refusal(*image); !why.empty()) return core::Status::invalid_argument(why);
  // Checked before the pixels are copied: what is refused costs nothing.
  const std::size_t pixels = std::size_t{image->width} * image->height;
  if (message.depth_mm().size() != pixels)
    return core::Status::invalid_argument("depth_mm has " + std::to_string(message.depth_mm().size()) +
                                          " values; allowed: width·height");
  image->depth_mm = message.depth_mm();
  return image;
}

core::Expected<OccupancyChange> from_idl(const msg::OccupancyChange& message, const ArmBounds& arm) {
  if (message.blocks().size() > kMaxOccupancyBlocks)
    return core::Status::invalid_argument("blocks has " + std::to_string(message.blocks().size()) +
                                          " items; allowed: at most " + std::to_string(kMaxOccupancyBlocks));
  if (message.cameras().size() > kMaxDepthCameras)
    return core::Status::invalid_argument("cameras has " + std::to_string(message.cameras().size()) +
                                          " items; allowed: at most " + std::to_string(kMaxDepthCameras));
  auto change = decoded<OccupancyChange>(kOccupancyChange, message, arm);
  if (!change) return change;
  if (const std::string why = refusal(*change); !why.empty()) return core::Status::invalid_argument(why);
  return change;
}

msg::DepthImage to_idl(const DepthImage& image) {
  auto message = encoded<msg::DepthImage>(kDepthImage, image);
  message.depth_mm(image.depth_mm);
  return message;
}
msg::OccupancyChange to_idl(const OccupancyChange& change) {
  return encoded<msg::OccupancyChange>(kOccupancyChange, change);
}

}  // namespace phantom::messages
