#include <AL/al.h>
#include <AL/alc.h>
#include <AL/alext.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "components/audio_percept/audio_percept.hpp"
#include "components/audio_percept/sink.hpp"

namespace phantom::audio_percept {
namespace {

// Sound libraries write to stderr while they look for devices; what matters is said by us in one line.
class QuietStderr {
 public:
  QuietStderr() : saved_(dup(STDERR_FILENO)) {
    std::fflush(stderr);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nowhere >= 0) {
      dup2(nowhere, STDERR_FILENO);
      close(nowhere);
    }
  }
  ~QuietStderr() {
    std::fflush(stderr);
    if (saved_ >= 0) {
      dup2(saved_, STDERR_FILENO);
      close(saved_);
    }
  }
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  int saved_;
};

// Asks OpenAL Soft for updates as short as our period: the application has no other way than a configuration
// file, which here is an anonymous one. A file that the user names prevails.
void ask_for_short_updates() {
  if (std::getenv("ALSOFT_CONF") != nullptr) return;
  static const int file = memfd_create("alsoft.conf", MFD_CLOEXEC);
  const std::string text = "[general]\nperiod_size = " + std::to_string(kPeriodFrames) + "\nperiods = 2\n";
  if (file < 0 || pwrite(file, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) return;
  setenv("ALSOFT_CONF", ("/proc/self/fd/" + std::to_string(file)).c_str(), 0);
}

// Periods to keep queued: what the device takes in one update and what passes between two of our turns, and
// one more that is being refilled. Three where the device grants the short updates: 15 ms.
std::size_t queue_length(ALCdevice* device) {
  ALCint updates_Hz = 0;
  alcGetIntegerv(device, ALC_REFRESH, 1, &updates_Hz);
  if (updates_Hz <= 0) return 4;
  const double periods_per_update = 1.0 / (updates_Hz * kPeriod_s);
  return static_cast<std::size_t>(std::clamp(std::ceil(periods_per_update + 0.5), 2.0, 64.0)) + 1;
}

class OpenAlSink final : public AudioSink {
 public:
  OpenAlSink(ALCdevice* device, ALCcontext* context) : device_(device), context_(context) {
    alcMakeContextCurrent(context_);
    buffers_.resize(queue_length(device_));
    alGenBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
    alGenSources(1, &source_);
    alSourcei(source_, AL_SOURCE_RELATIVE, AL_TRUE);
    watches_connection_ = alcIsExtensionPresent(device_, "ALC_EXT_disconnect") == ALC_TRUE;
    const char* name = alcGetString(device_, ALC_ALL_DEVICES_SPECIFIER);
    name_ = std::string("live: ") + (name != nullptr ? name : "default device");
  }
  ~OpenAlSink() override {
    alSourceStop(source_);
    alDeleteSources(1, &source_);
    alDeleteBuffers(static_cast<ALsizei>(buffers_.size()), buffers_.data());
    alcMakeContextCurrent(nullptr);
    alcDestroyContext(context_);
    alcCloseDevice(device_);
  }

  std::string name() const override { return name_; }

  int periods_due(double dt_s) override {
    ALint played = 0;
    alGetSourcei(source_, AL_BUFFERS_PROCESSED, &played);
    for (; played > 0; --played) {
      ALuint buffer = 0;
      alSourceUnqueueBuffers(source_, 1, &buffer);
      --queued_;
      since_progress_s_ = 0.0;
    }
    since_progress_s_ += dt_s;
    return static_cast<int>(buffers_.size()) - queued_;
  }

  void write(std::span<const std::int16_t> period) override {
    const ALuint buffer = buffers_[next_];
    next_ = (next_ + 1) % buffers_.size();
    alBufferData(buffer, AL_FORMAT_MONO16, period.data(), static_cast<ALsizei>(period.size_bytes()),
                 static_cast<ALsizei>(kSampleRate_Hz));
    alSourceQueueBuffers(source_, 1, &buffer);
    ++queued_;
    ALint state = 0;
    alGetSourcei(source_, AL_SOURCE_STATE, &state);
    // Starts, and starts again after the queue ran dry, once it is full.
    if (state != AL_PLAYING && queued_ == static_cast<int>(buffers_.size())) alSourcePlay(source_);
  }

  double queued_s() const override { return queued_ * kPeriod_s; }

  bool alive() const override {
    constexpr double kStuck_s = 2.0;
    if (since_progress_s_ > kStuck_s) return false;
    if (!watches_connection_) return true;
    ALCint connected = ALC_TRUE;
    alcGetIntegerv(device_, ALC_CONNECTED, 1, &connected);
    return connected == ALC_TRUE;
  }

 private:
  ALCdevice* device_;
  ALCcontext* context_;
  std::vector<ALuint> buffers_;
  ALuint source_ = 0;
  std::size_t next_ = 0;
  int queued_ = 0;
  double since_progress_s_ = 0.0;
  bool watches_connection_ = false;
  std::string name_;
};

}  // namespace

std::unique_ptr<AudioSink> open_live_sink(const std::string& device_name, std::string& reason) {
  const QuietStderr quiet;
  ask_for_short_updates();
  ALCdevice* device = alcOpenDevice(device_name.empty() ? nullptr : device_name.c_str());
  if (device == nullptr) {
    reason = device_name.empty() ? "no playback device opens"
                                 : "the playback device '" + device_name + "' does not open";
    return nullptr;
  }
  const std::array<ALCint, 3> wishes{ALC_FREQUENCY, static_cast<ALCint>(kSampleRate_Hz), 0};
  ALCcontext* context = alcCreateContext(device, wishes.data());
  if (context == nullptr) {
    reason = "the playback device opens but gives no context";
    alcCloseDevice(device);
    return nullptr;
  }
  return std::make_unique<OpenAlSink>(device, context);
}

}  // namespace phantom::audio_percept
