#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/dds/topics.hpp"

namespace phantom::dds {

/// The hash by which DDS knows an instance of a keyed topic.
using InstanceKey = std::array<std::uint8_t, 16>;

/// Turns samples of one topic into the bytes that they are on the wire and in a recording (encapsulation
/// header, then CDR), and back. Keeps its working memory; not thread-safe.
class CdrCodec {
 public:
  explicit CdrCodec(const TopicDescription& topic);
  ~CdrCodec();
  CdrCodec(CdrCodec&&) noexcept;

  const TopicDescription& topic() const;
  /// Whether samples have a key.
  bool keyed() const;
  /// Fills `sample`, an object of the topic's type. False if the bytes are not one; `sample` then holds
  /// anything.
  bool decode(std::span<const std::uint8_t> bytes, void* sample) const;
  /// False if the sample is beyond the bounds of its type.
  bool encode(const void* sample, std::vector<std::uint8_t>& bytes) const;
  /// The instance that the sample belongs to; of topics without key there is one. False if the bytes are no
  /// sample.
  bool instance_of(std::span<const std::uint8_t> bytes, InstanceKey& instance) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class T>
bool decode(const TopicSpec<T>& topic, std::span<const std::uint8_t> bytes, T& sample) {
  return CdrCodec(topic).decode(bytes, &sample);
}

/// The project's topic whose samples are of that type; null if there is none.
const TopicDescription* topic_of_type(std::string_view type_name);
/// The project's topic of that name; null if there is none.
const TopicDescription* topic_named(std::string_view name);

}  // namespace phantom::dds
