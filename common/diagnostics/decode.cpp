#include "common/diagnostics/decode.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "common/core/text.hpp"

namespace phantom::diagnostics {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kHeader = 4;      // encapsulation kind and options
constexpr std::size_t kMaxPadding = 3;  // to a whole word (4 octets), after the last member
constexpr int kDeepest = 64;            // greatest nesting; a deeper type is a mistake

/// What is wrong with a payload; caught by decode().
struct Fault {
  std::string what;
};

template <class Float>
Json number_of(Float value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  if constexpr (sizeof(Float) == 4) return std::stod(fmt::format("{}", value));
  return value;
}

/// Returns text as valid UTF-8: the JSON library replaces each invalid octet.
std::string valid_utf8(const std::string& text) {
  const bool ascii =
      std::all_of(text.begin(), text.end(), [](char c) { return static_cast<signed char>(c) >= 0; });
  if (ascii) return text;
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

class Cursor {
 public:
  Cursor(std::span<const std::uint8_t> payload, const DecodeOptions& options) : options_(options) {
    if (payload.size() < kHeader)
      throw Fault{
          fmt::format("{} octets: too short for the encapsulation header of {}", payload.size(), kHeader)};
    const unsigned kind = payload[0] << 8U | payload[1];
    if (kind > 1)
      throw Fault{fmt::format(
          "encapsulation {:#06x} is not plain CDR (allowed: 0x0000 big endian, 0x0001 little endian)", kind)};
    swap_ = (kind == 0) == (std::endian::native == std::endian::little);
    bytes_ = payload.subspan(kHeader);
  }

  Json value(const Type& type) {
    switch (type.kind) {
      case Kind::kBoolean:
        return boolean();
      case Kind::kOctet:
        return take<std::uint8_t>();
      case Kind::kChar:
        return valid_utf8(std::string(1, take<char>()));
      case Kind::kInt16:
        return take<std::int16_t>();
      case Kind::kUint16:
        return take<std::uint16_t>();
      case Kind::kInt32:
        return take<std::int32_t>();
      case Kind::kUint32:
        return take<std::uint32_t>();
      case Kind::kInt64:
        return take<std::int64_t>();
      case Kind::kUint64:
        return take<std::uint64_t>();
      case Kind::kFloat32:
        return number_of(take<float>());
      case Kind::kFloat64:
        return number_of(take<double>());
      case Kind::kString:
        return string(type);
      case Kind::kEnum:
        return literal(type);
      case Kind::kStruct:
        return structure(type);
      case Kind::kSequence:
        return sequence(type);
      case Kind::kArray:
        return elements(type, type.bound);
    }
    throw Fault{"a type of unknown kind"};
  }

  void end() const {
    if (left() > kMaxPadding)
      throw Fault{fmt::format(
          "{} octets follow the last member, which ends at {}: the sender's type has more members", left(),
          at_)};
  }

  /// The member being read, "points[3].name".
  const std::string& path() const { return path_; }
  std::size_t at() const { return at_; }

 private:
  std::size_t left() const { return bytes_.size() - at_; }

  void need(std::size_t size) const {
    if (size > left()) throw Fault{fmt::format("needs {} octets at {}, {} are left", size, at_, left())};
  }

  template <class T>
  T take() {
    const std::size_t padding = (sizeof(T) - at_ % sizeof(T)) % sizeof(T);
    need(padding + sizeof(T));
    at_ += padding;
    std::array<std::uint8_t, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  Json boolean() {
    const auto raw = take<std::uint8_t>();
    if (raw > 1) throw Fault{fmt::format("a boolean of {} (allowed: 0, 1)", raw)};
    return raw == 1;
  }

  Json string(const Type& type) {
    const auto length = take<std::uint32_t>();  // includes the closing zero
    if (length == 0) return "";                 // some vendors write an empty string like this
    need(length);
    const std::string text(reinterpret_cast<const char*>(bytes_.data() + at_), length - 1);
    if (bytes_[at_ + length - 1] != 0) throw Fault{"a string that does not end with a zero"};
    if (type.bound != 0 && text.size() > type.bound)
      throw Fault{fmt::format("a string of {} octets (allowed: {})", text.size(), type.bound)};
    at_ += length;
    return valid_utf8(text);
  }

  Json literal(const Type& type) {
    const auto raw = take<std::uint32_t>();
    for (const Literal& known : type.literals) {
      if (known.value == raw) return known.name;
    }
    return fmt::format("{} (no literal of {})", raw, type.name.substr(type.name.rfind(':') + 1));
  }

  Json structure(const Type& type) {
    if (++depth_ > kDeepest) throw Fault{fmt::format("nested more than {} deep", kDeepest)};
    Json object = Json::object();
    const std::size_t outer = path_.size();
    for (const Member& member : type.members) {
      path_ += (outer == 0 ? "" : ".") + member.name;
      object[member.name] = value(*member.type);
      path_.resize(outer);
    }
    --depth_;
    return object;
  }

  Json sequence(const Type& type) {
    const auto count = take<std::uint32_t>();
    if (type.bound != 0 && count > type.bound)
      throw Fault{fmt::format("a sequence of {} elements (allowed: {})", count, type.bound)};
    return elements(type, count);
  }

  Json elements(const Type& type, std::size_t count) {
    const std::size_t least = std::max<std::size_t>(least_size(*type.element), 1);
    if (count > left() / least)
      throw Fault{fmt::format("claims {} elements of at least {} octets at {}, {} are left", count, least,
                              at_, left())};
    if (type.element->kind == Kind::kOctet) return octets(count);
    Json array = Json::array();
    array.get_ref<Json::array_t&>().reserve(count);
    const std::size_t outer = path_.size();
    for (std::size_t i = 0; i < count; ++i) {
      path_ += fmt::format("[{}]", i);
      array.push_back(value(*type.element));
      path_.resize(outer);
    }
    return array;
  }

  Json octets(std::size_t count) {
    const std::string text = octets_text(bytes_.subspan(at_, count), options_.most_octets);
    at_ += count;
    return text;
  }

  std::span<const std::uint8_t> bytes_;  // after the header, where alignment begins
  const DecodeOptions& options_;
  std::size_t at_ = 0;
  bool swap_ = false;
  int depth_ = 0;
  std::string path_;
};

}  // namespace

core::Expected<Json> decode(const Type& type, std::span<const std::uint8_t> payload,
                            const DecodeOptions& options) {
  std::string member;
  try {
    Cursor cursor(payload, options);
    try {
      Json sample = cursor.value(type);
      cursor.end();
      return sample;
    } catch (const Fault&) {
      member = cursor.path();
      throw;
    }
  } catch (const Fault& fault) {
    const std::string place = member.empty() ? idl_name(type) : idl_name(type) + "." + member;
    return core::Status::invalid_argument(place + ": " + fault.what);
  }
}

std::string octets_text(std::span<const std::uint8_t> octets, std::size_t most) {
  const std::size_t shown = most == 0 ? octets.size() : std::min(octets.size(), most);
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * shown + 32);
  for (const std::uint8_t octet : octets.first(shown)) {
    text += kDigits[octet >> 4U];
    text += kDigits[octet & 15U];
  }
  if (shown < octets.size()) text += fmt::format("… ({} octets)", octets.size());
  return text;
}

std::string instance_name(const Type& type, const Json& sample) {
  std::string name;
  for (const Member& member : type.members) {
    if (!member.key || !sample.contains(member.name)) continue;
    const Json& value = sample[member.name];
    core::add_to_list(name,
                      member.name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
  }
  return name;
}

}  // namespace phantom::diagnostics
