#pragma once

// Little-endian fields of MCAP records. Private to common/recording.

#include <concepts>
#include <cstring>

#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

template <std::unsigned_integral T>
void put(Bytes& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
inline void put(Bytes& out, ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }
inline void put(Bytes& out, const std::string& text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out.insert(out.end(), text.begin(), text.end());
}

/// Overwrites the length field at `at` with the number of bytes that follow it.
template <std::unsigned_integral T>
void set_length(Bytes& out, std::size_t at) {
  const auto length = static_cast<T>(out.size() - at - sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) out[at + i] = static_cast<std::uint8_t>(length >> (8 * i));
}

/// Reads fields in sequence. After a missing field, every further field reads as empty and ok() returns
/// false.
class Fields {
 public:
  explicit Fields(ByteView bytes) : left_(bytes) {}
  bool ok() const { return ok_; }
  bool done() const { return left_.empty(); }
  ByteView rest() const { return left_; }

  ByteView take(std::uint64_t count) {
    if (count > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const ByteView taken = left_.first(static_cast<std::size_t>(count));
    left_ = left_.subspan(static_cast<std::size_t>(count));
    return taken;
  }
  template <std::unsigned_integral T>
  void get(T& value) {
    value = 0;
    const ByteView bytes = take(sizeof(T));
    for (std::size_t i = 0; i < bytes.size(); ++i)
      value = static_cast<T>(value | static_cast<T>(bytes[i]) << (8 * i));
  }
  template <std::unsigned_integral Length>
  ByteView get_block() {
    Length length = 0;
    get(length);
    return take(length);
  }
  void get(std::string& text) {
    const ByteView bytes = get_block<std::uint32_t>();
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }

 private:
  ByteView left_;
  bool ok_ = true;
};

}  // namespace phantom::recording
