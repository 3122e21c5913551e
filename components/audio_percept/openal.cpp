#include "components/audio_percept/openal.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {
namespace {

void set_thread_context(ALCcontext* context) noexcept {
  static const auto set =
      reinterpret_cast<PFNALCSETTHREADCONTEXTPROC>(alcGetProcAddress(nullptr, "alcSetThreadContext"));
  if (set != nullptr) set(context);
}

}  // namespace

QuietStderr::QuietStderr() : saved_(dup(STDERR_FILENO)) {
  std::fflush(stderr);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  dup2(nowhere, STDERR_FILENO);
  close(nowhere);
}
QuietStderr::~QuietStderr() {
  std::fflush(stderr);
  if (saved_ < 0) return;
  dup2(saved_, STDERR_FILENO);
  close(saved_);
}

void prepare_openal(Layout layout, int fifo_priority) {
  if (std::getenv("ALSOFT_CONF") != nullptr) return;
  // OpenAL Soft can be configured only by a file, here an anonymous one. The file sets the rate too: a device
  // that opens at another rate has its updates stretched to more than kPeriod_s.
  static const int file = memfd_create("alsoft.conf", MFD_CLOEXEC);
  std::string text =
      "[general]\nfrequency = 48000\nperiod_size = " + std::to_string(kPeriodFrames) + "\nperiods = 2\n";
  text += "rt-prio = " + std::to_string(fifo_priority) + "\n";
  if (layout == Layout::k5_1) text += "channels = surround51\n";
  if (layout == Layout::k7_1) text += "channels = surround71\n";
  if (file < 0 || pwrite(file, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) return;
  setenv("ALSOFT_CONF", ("/proc/self/fd/" + std::to_string(file)).c_str(), 0);
}

OpenAlContext::OpenAlContext(ALCdevice* device, const ALCint* attributes) : device_(device) {
  if (device_ != nullptr) context_ = alcCreateContext(device_, attributes);
}

OpenAlContext::~OpenAlContext() {
  if (context_ != nullptr) alcDestroyContext(context_);
  if (device_ != nullptr) alcCloseDevice(device_);
}

OpenAlContext::Use::Use(const OpenAlContext& context) noexcept { set_thread_context(context.context_); }
OpenAlContext::Use::~Use() { set_thread_context(nullptr); }

SourceQueue::SourceQueue(std::size_t most_queued) : buffers_(most_queued) {
  alGenSources(1, &source_);
  alGenBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
  alSourcei(source_, AL_SOURCE_RELATIVE, AL_TRUE);
}
SourceQueue::~SourceQueue() {
  alSourceStop(source_);
  alDeleteSources(1, &source_);
  alDeleteBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
}

int SourceQueue::reclaim() noexcept {
  ALint played = 0;
  alGetSourcei(source_, AL_BUFFERS_PROCESSED, &played);
  for (ALint i = 0; i < played; ++i) {
    ALuint buffer = 0;
    alSourceUnqueueBuffers(source_, 1, &buffer);
  }
  queued_ -= played;
  return played;
}

void SourceQueue::add(ALenum format, std::span<const std::byte> samples) noexcept {
  const ALuint buffer = buffers_[next_];
  next_ = (next_ + 1) % buffers_.size();
  alBufferData(buffer, format, samples.data(), static_cast<ALsizei>(samples.size()),
               static_cast<ALsizei>(kSampleRate_Hz));
  alSourceQueueBuffers(source_, 1, &buffer);
  ++queued_;
}

bool SourceQueue::play() noexcept {
  ALint state = 0;
  alGetSourcei(source_, AL_SOURCE_STATE, &state);
  if (state != AL_PLAYING) alSourcePlay(source_);
  return state != AL_PLAYING;
}

}  // namespace phantom::audio_percept
