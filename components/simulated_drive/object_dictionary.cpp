#include "components/simulated_drive/object_dictionary.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>
#include <string_view>

namespace phantom::simulated_drive {
namespace {

std::uint32_t key(std::uint16_t index, std::uint8_t sub) { return std::uint32_t{index} * 256 + sub; }

std::int64_t number_in(const std::vector<std::uint8_t>& bytes, bool is_signed) {
  std::int64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value * 256 + bytes[i];
  const std::int64_t span = std::int64_t{1} << (8 * std::min<std::size_t>(bytes.size(), 7));
  return is_signed && value >= span / 2 ? value - span : value;
}

/// An object of the data sheet.
struct Declared {
  std::uint16_t index;
  std::uint8_t sub;
  ObjectDictionary::Object object;
  std::int64_t value = 0;
  bool plus_node = false;  // the node id is added to the value
};

Declared of_type(unsigned index, unsigned sub, int data_type) {
  constexpr std::array<std::size_t, 8> kSize{0, 0, 1, 2, 4, 1, 2, 4};  // signed, then unsigned integers
  const bool is_text = data_type == 9;
  return {static_cast<std::uint16_t>(index),
          static_cast<std::uint8_t>(sub),
          {.bytes = std::vector<std::uint8_t>(is_text ? 0 : kSize.at(static_cast<std::size_t>(data_type))),
           .any_length = is_text,
           .is_signed = data_type <= 4}};
}

void take_entry(const std::string& key, const std::string& text, Declared& declared) {
  ObjectDictionary::Object& object = declared.object;
  if (key == "AccessType") object.writable = text == "rw";
  if (key == "LowLimit") object.least = std::stoll(text);
  if (key == "HighLimit") object.most = std::stoll(text);
  if (key == "PDOMapping") object.mappable = text == "1";
  if (key != "DefaultValue") return;
  constexpr std::string_view kNode = "$NODEID+";
  declared.plus_node = text.starts_with(kNode);
  if (object.any_length) {
    object.bytes.assign(text.begin(), text.end());
  } else {
    declared.value = std::stoll(declared.plus_node ? text.substr(kNode.size()) : text, nullptr, 0);
  }
}

std::vector<Declared> read_sheet() {
  std::vector<Declared> all;
  unsigned index = 0, sub = 0;
  std::istringstream lines(kDataSheet);
  for (std::string line; std::getline(lines, line);) {
    const auto equals = line.find('=');
    if (line.starts_with('[')) {  // [6040] or [1018sub1]
      sub = 0;
      std::sscanf(line.c_str(), "[%Xsub%X]", &index, &sub);
    } else if (line.starts_with("DataType=")) {
      all.push_back(of_type(index, sub, std::stoi(line.substr(equals + 1), nullptr, 0)));
    } else if (equals != std::string::npos && !all.empty()) {
      take_entry(line.substr(0, equals), line.substr(equals + 1), all.back());
    }
  }
  return all;
}

}  // namespace

void ObjectDictionary::add_from_sheet(std::uint16_t first, std::uint16_t last, int node) {
  static const std::vector<Declared> sheet = read_sheet();
  for (const Declared& declared : sheet) {
    if (declared.index < first || declared.index > last) continue;
    objects_[key(declared.index, declared.sub)] = declared.object;
    if (!declared.object.any_length)
      set(declared.index, declared.sub, declared.value + (declared.plus_node ? node : 0));
  }
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
