#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "common/dds/endpoints/topics.hpp"

namespace phantom::interop {

/// Another vendor's two participants (Cyclone DDS, on loopback): what comes on a topic in one domain is
/// decoded into that vendor's own struct, and that struct published in the other. A sample that comes back as
/// it was has been read and written by them in every member.
class CycloneMirror {
 public:
  /// Throws std::runtime_error naming what Cyclone DDS refused.
  CycloneMirror(const dds::TopicDescription& topic, int from_domain, int to_domain);
  ~CycloneMirror();
  CycloneMirror(const CycloneMirror&) = delete;

  /// Whether it hears a writer in the one domain and is heard by a reader in the other.
  bool connected() const;
  std::uint64_t mirrored() const { return mirrored_; }

 private:
  void run();

  std::int32_t from_ = 0, to_ = 0, reader_ = 0, writer_ = 0;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> mirrored_{0};
  std::thread thread_;
};

}  // namespace phantom::interop
