#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/dds/endpoints/topics.hpp"

namespace phantom::dds {

/// The hash that identifies an instance of a keyed topic in DDS.
using InstanceKey = std::array<std::uint8_t, 16>;

/// Serialises samples of one topic to the bytes used on the wire and in a recording (encapsulation header,
/// then CDR), and deserialises them. Keeps its working memory; not thread-safe.
class CdrCodec {
 public:
  explicit CdrCodec(const TopicDescription& topic);
  ~CdrCodec();
  CdrCodec(CdrCodec&&) noexcept;

  const TopicDescription& topic() const;
  /// Returns whether the topic is keyed.
  bool keyed() const;
  /// Deserialises `bytes` into `sample`, an object of the topic's type. Returns false if the bytes are not a
  /// sample; the content of `sample` is then unspecified.
  bool decode(std::span<const std::uint8_t> bytes, void* sample) const;
  /// Serialises `sample` into `bytes`. Returns false if the sample exceeds the bounds of its type.
  bool encode(const void* sample, std::vector<std::uint8_t>& bytes) const;
  /// Finds the instance that the sample belongs to; a topic without a key has one instance. Returns false if
  /// the bytes are not a sample.
  bool instance_of(std::span<const std::uint8_t> bytes, InstanceKey& instance) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Deserialises samples of one topic. Not thread-safe.
template <class T>
class TopicDecoder {
 public:
  explicit TopicDecoder(const TopicSpec<T>& topic) : codec_(topic) {}
  const TopicDescription& topic() const { return codec_.topic(); }
  /// Returns the sample, valid until the next call; null if the bytes are none.
  const T* decode(std::span<const std::uint8_t> bytes) {
    return codec_.decode(bytes, &sample_) ? &sample_ : nullptr;
  }

 private:
  CdrCodec codec_;
  T sample_;
};

template <class T>
bool decode(const TopicSpec<T>& topic, std::span<const std::uint8_t> bytes, T& sample) {
  return CdrCodec(topic).decode(bytes, &sample);
}

/// Returns the project's topic whose samples have that type; null if there is none.
const TopicDescription* topic_of_type(std::string_view type_name);
/// Returns the project's topic of that name; null if there is none.
const TopicDescription* topic_named(std::string_view name);

}  // namespace phantom::dds
