#include "components/simulated_drive/object_dictionary.hpp"

#include <algorithm>

namespace phantom::simulated_drive {
namespace {

std::uint32_t key(std::uint16_t index, std::uint8_t sub) { return std::uint32_t{index} * 256 + sub; }

std::int64_t number_in(const std::vector<std::uint8_t>& bytes, bool is_signed) {
  std::int64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value * 256 + bytes[i];
  const std::int64_t span = std::int64_t{1} << (8 * std::min<std::size_t>(bytes.size(), 7));
  return is_signed && value >= span / 2 ? value - span : value;
}

}  // namespace

void ObjectDictionary::add(std::uint16_t index, std::uint8_t sub, std::size_t size, std::int64_t value,
                           bool writable, bool mappable, bool is_signed) {
  objects_[key(index, sub)] = {.bytes = std::vector<std::uint8_t>(size),
                               .writable = writable,
                               .mappable = mappable,
                               .is_signed = is_signed};
  set(index, sub, value);
}

void ObjectDictionary::add_text(std::uint16_t index, const std::string& text, bool writable) {
  objects_[key(index, 0)] = {.bytes = {text.begin(), text.end()}, .writable = writable, .any_length = true};
}

void ObjectDictionary::limit(std::uint16_t index, std::uint8_t sub, std::int64_t least, std::int64_t most) {
  Object& object = objects_.at(key(index, sub));
  object.least = least;
  object.most = most;
}

const ObjectDictionary::Object* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const {
  const auto found = objects_.find(key(index, sub));
  return found == objects_.end() ? nullptr : &found->second;
}

AbortCode ObjectDictionary::missing(std::uint16_t index) const {
  const auto next = objects_.lower_bound(key(index, 0));
  const bool known = next != objects_.end() && next->first / 256 == index;
  return known ? kAbortNoSub : kAbortNoObject;
}

std::int64_t ObjectDictionary::value(std::uint16_t index, std::uint8_t sub) const {
  const Object& object = objects_.at(key(index, sub));
  return number_in(object.bytes, object.is_signed);
}

void ObjectDictionary::set(std::uint16_t index, std::uint8_t sub, std::int64_t value) {
  for (std::uint8_t& byte : objects_.at(key(index, sub)).bytes) {
    byte = static_cast<std::uint8_t>(value & 0xFF);
    value >>= 8;
  }
}

AbortCode ObjectDictionary::write(std::uint16_t index, std::uint8_t sub,
                                  const std::vector<std::uint8_t>& bytes) {
  const auto found = objects_.find(key(index, sub));
  if (found == objects_.end()) return missing(index);
  Object& object = found->second;
  if (!object.writable) return kAbortReadOnly;
  if (!object.any_length) {
    if (bytes.size() != object.bytes.size()) return kAbortWrongLength;
    const std::int64_t value = number_in(bytes, object.is_signed);
    if (value < object.least || value > object.most) return kAbortRange;
  }
  object.bytes = bytes;
  return kNoAbort;
}

}  // namespace phantom::simulated_drive
