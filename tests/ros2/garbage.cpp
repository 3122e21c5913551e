#include "tests/ros2/garbage.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace phantom::ros2::test {

using diagnostics::Kind;

double Garbage::real() {
  constexpr double kAbsurd[] = {0.0,
                                -0.0,
                                0.1,
                                1.0,
                                -1.0,
                                1e-300,
                                1e300,
                                std::numeric_limits<double>::max(),
                                std::numeric_limits<double>::infinity(),
                                -std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::denorm_min()};
  if (below(2) == 0) return std::uniform_real_distribution(-1.0, 1.0)(random_);
  return kAbsurd[below(std::size(kAbsurd))];
}

void Garbage::put_number(std::size_t octets) {
  while ((bytes_.size() - 4) % octets != 0) bytes_.push_back(0);
  const bool small = below(2) == 0;
  for (std::size_t i = 0; i < octets; ++i)
    bytes_.push_back(static_cast<std::uint8_t>(small ? (i == 0 ? below(5) : 0) : random_()));
}

void Garbage::put_length(std::uint32_t length) {
  while ((bytes_.size() - 4) % 4 != 0) bytes_.push_back(0);
  if (lies_ && below(4) == 0) length = below(2) == 0 ? 0xffffffffU : static_cast<std::uint32_t>(random_());
  for (int shift = 0; shift < 32; shift += 8) bytes_.push_back(static_cast<std::uint8_t>(length >> shift));
}

void Garbage::put_text() {
  std::string text;
  if (below(4) != 0 && !words_.empty()) {
    text = words_[below(static_cast<std::uint32_t>(words_.size()))];
  } else {
    text.resize(below(50) == 0 ? 20'000 : below(20));
    for (char& c : text) c = static_cast<char>(1 + below(255));
  }
  put_length(static_cast<std::uint32_t>(text.size() + 1));
  bytes_.insert(bytes_.end(), text.begin(), text.end());
  bytes_.push_back(0);
}

void Garbage::put(const diagnostics::Type& type) {
  switch (type.kind) {
    case Kind::kStruct:
      for (const auto& member : type.members) put(*member.type);
      return;
    case Kind::kArray:
      for (std::uint32_t i = 0; i < type.bound; ++i) put(*type.element);
      return;
    case Kind::kSequence: {
      std::uint32_t count = below(4);
      if (below(200) == 0 && diagnostics::primitive_size(type.element->kind) > 0) count = 20'000;
      if (type.bound > 0) count = std::min(count, type.bound);
      put_length(count);
      for (std::uint32_t i = 0; i < count; ++i) put(*type.element);
      return;
    }
    case Kind::kString:
      return put_text();
    case Kind::kBoolean:
      return bytes_.push_back(static_cast<std::uint8_t>(below(2)));
    case Kind::kFloat64: {
      while ((bytes_.size() - 4) % 8 != 0) bytes_.push_back(0);
      const double value = real();
      const auto* octets = reinterpret_cast<const std::uint8_t*>(&value);
      bytes_.insert(bytes_.end(), octets, octets + sizeof value);
      return;
    }
    case Kind::kFloat32: {
      while ((bytes_.size() - 4) % 4 != 0) bytes_.push_back(0);
      const auto value = static_cast<float>(real());
      const auto* octets = reinterpret_cast<const std::uint8_t*>(&value);
      bytes_.insert(bytes_.end(), octets, octets + sizeof value);
      return;
    }
    default:
      return put_number(std::max<std::size_t>(1, diagnostics::primitive_size(type.kind)));
  }
}

std::vector<std::uint8_t> Garbage::message(const diagnostics::Type& type) {
  const std::uint32_t kind = below(9);
  bytes_ = {0, 1, 0, 0};
  lies_ = kind == 3;
  if (kind == 4) {
    bytes_.resize(4 + below(below(20) == 0 ? 200'000 : 300));
    for (std::size_t i = 4; i < bytes_.size(); ++i) bytes_[i] = static_cast<std::uint8_t>(random_());
    return bytes_;
  }
  put(type);
  if (kind == 5 || kind == 6) bytes_.resize(4 + below(static_cast<std::uint32_t>(bytes_.size() - 3)));
  if (kind == 7)
    for (std::uint32_t hits = 1 + below(4); hits > 0; --hits)
      bytes_[below(static_cast<std::uint32_t>(bytes_.size()))] = static_cast<std::uint8_t>(random_());
  if (kind == 8) bytes_[1] = static_cast<std::uint8_t>(below(16));  // another representation, or byte order
  return bytes_;
}

}  // namespace phantom::ros2::test
