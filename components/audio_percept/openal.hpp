#pragma once

#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>

#include <cstddef>
#include <span>
#include <vector>

#include "components/audio_percept/layout.hpp"

namespace phantom::audio_percept {

/// Silences stderr while it lives: sound libraries write to it while they look for devices. The component
/// logs what matters in one line.
class QuietStderr {
 public:
  QuietStderr();
  ~QuietStderr();
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  int saved_;
};

/// Configures OpenAL Soft for updates as short as kPeriod_s, for the loudspeakers of `layout` and for a
/// mixing thread of SCHED_FIFO priority `fifo_priority` (0: an ordinary thread), unless the user names a
/// configuration file. Call it before any other use of OpenAL, which reads the configuration once per
/// process.
void prepare_openal(Layout layout, int fifo_priority = 0);

/// An OpenAL device with a context. The context is current in a thread only while a Use of it lives there, so
/// that a loopback device and a playback device can be used side by side, in any threads.
class OpenAlContext {
 public:
  /// Takes ownership of the device; null stands for one that did not open. `attributes` end with 0.
  OpenAlContext(ALCdevice* device, const ALCint* attributes);
  ~OpenAlContext();
  OpenAlContext(const OpenAlContext&) = delete;
  OpenAlContext& operator=(const OpenAlContext&) = delete;

  explicit operator bool() const noexcept { return context_ != nullptr; }
  ALCdevice* device() const noexcept { return device_; }

  class Use {
   public:
    explicit Use(const OpenAlContext& context) noexcept;
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
  };

 private:
  ALCdevice* device_;
  ALCcontext* context_ = nullptr;
};

/// A source fed through a queue of buffers, relative to the listener. A context must be in use for every
/// call.
class SourceQueue {
 public:
  explicit SourceQueue(std::size_t most_queued);
  ~SourceQueue();
  SourceQueue(const SourceQueue&) = delete;
  SourceQueue& operator=(const SourceQueue&) = delete;

  ALuint source() const noexcept { return source_; }
  int queued() const noexcept { return queued_; }
  /// Takes back the buffers that were played. Returns how many.
  int reclaim() noexcept;
  /// Queues samples of 48 kHz. Call it only while fewer than `most_queued` are queued.
  void add(ALenum format, std::span<const std::byte> samples) noexcept;
  /// Starts the source if it does not play. Returns whether that was needed.
  bool play() noexcept;

 private:
  std::vector<ALuint> buffers_;
  ALuint source_ = 0;
  std::size_t next_ = 0;
  int queued_ = 0;
};

}  // namespace phantom::audio_percept
