#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace phantom::wire {

/// Reads numbers from octets that a stranger may have written. A read beyond the end gives 0 and makes the
/// reader bad for ever, so that a parser may read several fields and check once. Positions count from the
/// first octet of the span. Real-time safe: yes.
class OctetReader {
 public:
  OctetReader(std::span<const std::uint8_t> octets, bool little_endian)
      : octets_(octets), little_(little_endian) {}

  bool good() const { return good_; }
  std::size_t position() const { return position_; }
  std::size_t left() const { return octets_.size() - position_; }
  bool little_endian() const { return little_; }

  /// Skips `count` octets; false, and bad, if there are fewer.
  bool skip(std::size_t count) {
    if (!good_ || count > left()) return good_ = false;
    position_ += count;
    return true;
  }
  /// Skips to the next multiple of `alignment` (a power of two), counted from the span's start.
  bool align(std::size_t alignment) { return skip((alignment - position_ % alignment) % alignment); }

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::int64_t i64_as_two() {  ///< a sequence number: high word signed, low word unsigned
    const std::uint64_t high = u32();
    return static_cast<std::int64_t>(high << 32 | u32());
  }
  /// An entity id: four octets in the order in which they stand, whatever the endianness.
  std::uint32_t entity() {
    const auto four = take(4);
    std::uint32_t value = 0;
    for (const std::uint8_t octet : four) value = value << 8 | octet;
    return value;
  }
  /// The next `count` octets; empty, and bad, if there are fewer.
  std::span<const std::uint8_t> take(std::size_t count) {
    const std::size_t from = position_;
    return skip(count) ? octets_.subspan(from, count) : std::span<const std::uint8_t>();
  }

  /// Skips a CDR string: its length with the ending zero, then its characters. Bad if it has no ending zero.
  bool string() {
    const std::size_t length = u32();
    const auto text = take(length);
    return good_ = good_ && length > 0 && text.back() == 0;
  }

 private:
  std::uint64_t number(std::size_t count) {
    const auto octets = take(count);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < octets.size(); ++i)
      value = value << 8 | octets[little_ ? octets.size() - 1 - i : i];
    return value;
  }

  std::span<const std::uint8_t> octets_;
  std::size_t position_ = 0;
  bool little_, good_ = true;
};

}  // namespace phantom::wire
