#include "common/can/wrench_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace phantom::can {

std::vector<std::uint32_t> ids_of(const WrenchFrames& frames) {
  std::vector<std::uint32_t> ids;
  for (const WrenchChannel& channel : frames.channels) ids.push_back(channel.id);
  for (const StatusBits& status : frames.status) ids.push_back(status.id);
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

core::Status check(const WrenchFrames& frames) {
  const auto refuse = [](const std::string& why) { return core::Status::invalid_argument(why); };
  if (frames.bytes < 1 || frames.bytes > 4 || (frames.kind == NumberKind::kFloat && frames.bytes != 4))
    return refuse("numbers of " + std::to_string(frames.bytes) + " bytes; allowed: 1 to 4, of a float 4");
  const std::vector<std::uint32_t> ids = ids_of(frames);
  if (ids.size() > WrenchFrames::kMax)
    return refuse(std::to_string(ids.size()) + " frames; allowed: at most " +
                  std::to_string(WrenchFrames::kMax));
  const std::uint32_t highest = frames.extended ? (1U << 29) - 1 : (1U << 11) - 1;
  for (std::size_t c = 0; c < frames.channels.size(); ++c)
    if (frames.channels[c].id > highest)
      return refuse(std::string(kWrenchNames[c]) + ": id " + std::to_string(frames.channels[c].id) +
                    "; allowed: 0 to " + std::to_string(highest));
  if (ids.back() > highest)
    return refuse("status: id " + std::to_string(ids.back()) + "; allowed: 0 to " + std::to_string(highest));
  for (std::size_t c = 0; c < frames.channels.size(); ++c) {
    const WrenchChannel& channel = frames.channels[c];
    const std::string own = std::string(kWrenchNames[c]) + ": ";
    if (channel.first < 0 || channel.first + frames.bytes > 8)
      return refuse(own + "a number from byte " + std::to_string(channel.first) + "; allowed: 0 to " +
                    std::to_string(8 - frames.bytes));
    if (!std::isfinite(channel.scale) || channel.scale == 0.0 || !std::isfinite(channel.zero))
      return refuse(own + "a scale of " + std::to_string(channel.scale) + "; allowed: other than 0");
    for (std::size_t other = 0; other < c; ++other)
      if (channel.id == frames.channels[other].id &&
          std::abs(channel.first - frames.channels[other].first) < frames.bytes)
        return refuse(own + "a number from byte " + std::to_string(channel.first) + " of frame " +
                      std::to_string(channel.id) + ", which has that of " + kWrenchNames[other] +
                      " from byte " + std::to_string(frames.channels[other].first) +
                      "; allowed: bytes of its own");
  }
  for (const StatusBits& status : frames.status) {
    if (status.byte < 0 || status.byte > 7 || (status.good & ~status.mask) != 0)
      return refuse("status of byte " + std::to_string(status.byte) +
                    "; allowed: 0 to 7, with `good` within `mask`");
  }
  return core::Status::ok();
}

WrenchAssembly::WrenchAssembly(const WrenchFrames& frames)
    : frames_(frames),
      ids_(ids_of(frames)),
      needed_bytes_(ids_.size(), 0),
      set_ns_(core::from_seconds(frames.set_s)) {
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    int& needed = needed_bytes_[i];
    for (const WrenchChannel& channel : frames_.channels)
      if (channel.id == ids_[i]) needed = std::max(needed, channel.first + frames_.bytes);
    for (const StatusBits& status : frames_.status)
      if (status.id == ids_[i]) needed = std::max(needed, status.byte + 1);
  }
}

double WrenchAssembly::number(const CanFrame& frame, int first) const noexcept {
  std::uint32_t bits = 0;
  for (int i = 0; i < frames_.bytes; ++i) {
    const int place = frames_.big_endian ? first + i : first + frames_.bytes - 1 - i;
    bits = bits << 8 | frame.data[static_cast<std::size_t>(place)];
  }
  if (frames_.kind == NumberKind::kFloat) return static_cast<double>(std::bit_cast<float>(bits));
  if (frames_.kind == NumberKind::kUnsigned) return static_cast<double>(bits);
  const int unused = 32 - 8 * frames_.bytes;
  return static_cast<double>(static_cast<std::int32_t>(bits << unused) >> unused);
}

bool WrenchAssembly::take(const CanFrame& frame, core::Nanoseconds time_ns) noexcept {
  if (frame.extended != frames_.extended || frame.remote) return false;
  const auto found = std::find(ids_.begin(), ids_.end(), frame.id);
  if (found == ids_.end()) return false;
  const auto place = static_cast<std::size_t>(found - ids_.begin());
  const std::uint32_t bit = 1U << place;
  if (come_ != 0 && ((come_ & bit) != 0 || time_ns - next_.time_ns > set_ns_)) {
    ++incomplete_;
    come_ = 0;
  }
  if (come_ == 0) {
    next_.time_ns = time_ns;
    next_.valid = true;
  }
  come_ |= bit;
  const bool long_enough = frame.length >= needed_bytes_[place];
  next_.valid = next_.valid && long_enough;
  for (std::size_t c = 0; long_enough && c < frames_.channels.size(); ++c) {
    const WrenchChannel& channel = frames_.channels[c];
    if (channel.id != frame.id) continue;
    next_.values[c] = channel.zero + channel.scale * number(frame, channel.first);
    next_.valid = next_.valid && std::isfinite(next_.values[c]);
  }
  for (const StatusBits& status : frames_.status) {
    if (status.id != frame.id || !long_enough) continue;
    next_.valid =
        next_.valid && (frame.data[static_cast<std::size_t>(status.byte)] & status.mask) == status.good;
  }
  if (come_ != (1U << ids_.size()) - 1) return false;
  come_ = 0;
  whole_ = next_;
  return true;
}

}  // namespace phantom::can
