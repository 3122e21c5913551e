#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace phantom::simulated_drive {

/// Reasons for refusing an access: abort codes of CiA 301.
enum AbortCode : std::uint32_t {
  kNoAbort = 0,
  kAbortReadOnly = 0x06010002,
  kAbortNoObject = 0x06020000,
  kAbortNotMappable = 0x06040041,
  kAbortMappingTooLong = 0x06040042,
  kAbortWrongLength = 0x06070010,
  kAbortNoSub = 0x06090011,
  kAbortRange = 0x06090030,
  kAbortState = 0x08000022,
};

/// The drive's electronic data sheet (CiA 306), simulated_drive.eds: declares every object of its dictionary.
extern const char* const kDataSheet;

/// Object dictionary of one device: every value with its size, access rights and limits.
class ObjectDictionary {
 public:
  struct Object {
    std::vector<std::uint8_t> bytes;  ///< little-endian
    bool writable = false;
    bool mappable = false;
    bool any_length = false;  ///< a string: writes may change its length
    std::int64_t least = INT64_MIN, most = INT64_MAX;
    bool is_signed = false;
  };

  /// Creates the objects of the data sheet with an index from `first` to `last`, with their default values
  /// for `node`.
  void add_from_sheet(std::uint16_t first, std::uint16_t last, int node);

  const Object* find(std::uint16_t index, std::uint8_t sub) const;
  AbortCode missing(std::uint16_t index) const;
  /// Returns all objects, keyed by index · 256 + sub-index.
  const std::map<std::uint32_t, Object>& objects() const { return objects_; }
  std::int64_t value(std::uint16_t index, std::uint8_t sub = 0) const;
  /// Sets any value without checks, for the device itself.
  void set(std::uint16_t index, std::uint8_t sub, std::int64_t value);
  /// Writes a value for the bus after checking rights, length and limits.
  AbortCode write(std::uint16_t index, std::uint8_t sub, const std::vector<std::uint8_t>& bytes);

 private:
  std::map<std::uint32_t, Object> objects_;
};

}  // namespace phantom::simulated_drive
