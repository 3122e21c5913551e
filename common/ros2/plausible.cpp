#include "common/ros2/plausible.hpp"

namespace phantom::ros2 {
namespace {

/// Returns how many fields a PointCloud2 announces; all that can be if it ends before.
std::uint32_t fields_of(std::span<const std::uint8_t> cdr) noexcept {
  constexpr std::uint32_t kAll = UINT32_MAX;
  // Encapsulation (4 octets; the second names the byte order), stamp (8), frame_id, height, width, fields.
  constexpr std::size_t kHeader = 4;
  if (cdr.size() < kHeader) return kAll;
  const bool big_endian = (cdr[1] & 1) == 0;
  std::size_t at = kHeader + 8;
  const auto next = [&](std::uint32_t& value) {
    at = kHeader + (at - kHeader + 3) / 4 * 4;
    if (at > cdr.size() || cdr.size() - at < 4) return false;
    value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= std::uint32_t{cdr[at + i]} << 8 * (big_endian ? 3 - i : i);
    at += 4;
    return true;
  };
  std::uint32_t frame_octets = 0, height = 0, width = 0, fields = 0;
  if (!next(frame_octets) || frame_octets > cdr.size() - at) return kAll;
  at += frame_octets;
  return next(height) && next(width) && next(fields) ? fields : kAll;
}

}  // namespace

bool is_plausible(std::string_view dds_type_name, std::span<const std::uint8_t> cdr) noexcept {
  if (dds_type_name == "sensor_msgs::msg::dds_::PointCloud2_")
    return cdr.size() <= kMaxDataOctets && fields_of(cdr) <= kMaxFields;
  const bool has_data = dds_type_name == "sensor_msgs::msg::dds_::Image_" ||
                        dds_type_name == "sensor_msgs::msg::dds_::CompressedImage_";
  return cdr.size() <= (has_data ? kMaxDataOctets : kMaxOctets);
}

}  // namespace phantom::ros2
