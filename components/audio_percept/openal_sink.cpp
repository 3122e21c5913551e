#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/core/thread_config.hpp"
#include "components/audio_percept/audio_percept.hpp"
#include "components/audio_percept/openal.hpp"
#include "components/audio_percept/sink.hpp"

namespace phantom::audio_percept {
namespace {

constexpr int kMaxQueued = 64;
constexpr double kCalm_s = 120.0;  // after this time without an interruption, the queue is made shorter

// A device that has just started fills its own buffers faster than it plays. A queue that runs dry within
// this time says nothing about the host.
constexpr double kSettling_s = 0.2;

double update_period_s(ALCdevice* device) {
  ALCint updates_Hz = 0;
  alcGetIntegerv(device, ALC_REFRESH, 1, &updates_Hz);
  return updates_Hz > 0 ? 1.0 / updates_Hz : 0.02;
}

// Returns how many periods to keep queued at first: what the device takes in one update and what passes
// between two of our turns. That is two, 10 ms, if the device grants the short updates.
int least_queue(double update_s) {
  return static_cast<int>(std::clamp(std::ceil(update_s / kPeriod_s + 0.5), 2.0, 0.5 * kMaxQueued));
}

ALenum format_of(Layout layout) {
  return layout == Layout::kMono  ? AL_FORMAT_MONO16
         : layout == Layout::k5_1 ? alGetEnumValue("AL_FORMAT_51CHN16")
         : layout == Layout::k7_1 ? alGetEnumValue("AL_FORMAT_71CHN16")
                                  : AL_FORMAT_STEREO16;
}

class OpenAlSink final : public AudioSink {
 public:
  OpenAlSink(std::unique_ptr<OpenAlContext> context, Layout layout) : context_(std::move(context)) {
    const OpenAlContext::Use use(*context_);
    format_ = format_of(layout);
    update_s_ = update_period_s(context_->device());
    wanted_ = least_ = least_queue(update_s_);
    queue_.emplace(kMaxQueued);
    // Left and right are played unchanged. Surround is panned to the loudspeakers that exist, so that no
    // channel is lost where there are fewer.
    const bool as_it_is = layout == Layout::kStereo || layout == Layout::kHrtf;
    if (as_it_is && alIsExtensionPresent("AL_SOFT_direct_channels") == AL_TRUE)
      alSourcei(queue_->source(), AL_DIRECT_CHANNELS_SOFT, AL_TRUE);
    ALCdevice* device = context_->device();
    watches_connection_ = alcIsExtensionPresent(device, "ALC_EXT_disconnect") == ALC_TRUE;
    if (alcIsExtensionPresent(device, "ALC_SOFT_device_clock") == ALC_TRUE) {
      get_64_ = reinterpret_cast<LPALCGETINTEGER64VSOFT>(alcGetProcAddress(device, "alcGetInteger64vSOFT"));
    }
    const char* name = alcGetString(device, ALC_ALL_DEVICES_SPECIFIER);
    name_ = std::string("live: ") + (name != nullptr ? name : "default device");
  }
  ~OpenAlSink() override {
    const OpenAlContext::Use use(*context_);
    queue_.reset();
  }

  std::string name() const override { return name_; }

  int periods_due(double dt_s) override {
    const OpenAlContext::Use use(*context_);
    since_progress_s_ = queue_->reclaim() > 0 ? 0.0 : since_progress_s_ + dt_s;
    calm_s_ += dt_s;
    age_s_ += dt_s;
    adapt();
    return std::max(0, wanted_ - queue_->queued());
  }

  void write(std::span<const std::int16_t> period) override {
    const OpenAlContext::Use use(*context_);
    queue_->add(format_, std::as_bytes(period));
    // Starts once the queue is full, also after it ran dry.
    if (queue_->queued() >= wanted_ && queue_->play()) playing_ = true;
  }

  // Includes the time until the next update, because the device takes one update at a time.
  double queued_s() const override {
    return queue_->queued() * kPeriod_s + (playing_ ? std::max(0.0, update_s_ - since_progress_s_) : 0.0);
  }

  double device_latency_s() const override {
    if (get_64_ == nullptr) return 0.0;
    ALCint64SOFT latency_ns = 0;
    get_64_(context_->device(), ALC_DEVICE_LATENCY_SOFT, 1, &latency_ns);
    return std::max(0.0, 1e-9 * static_cast<double>(latency_ns));
  }

  std::uint64_t interruptions() const override { return interruptions_; }

  bool alive() const override {
    constexpr double kStuck_s = 2.0;
    if (since_progress_s_ > kStuck_s) return false;
    if (!watches_connection_) return true;
    ALCint connected = ALC_TRUE;
    alcGetIntegerv(context_->device(), ALC_CONNECTED, 1, &connected);
    return connected == ALC_TRUE;
  }

 private:
  // Makes the queue longer after it ran dry, because a host that was late is likely to be late again. Makes
  // it shorter after a long time without an interruption.
  void adapt() {
    if (playing_ && queue_->queued() == 0) {
      playing_ = false;
      ++interruptions_;
      if (age_s_ > kSettling_s) wanted_ = std::min(wanted_ + 1, kMaxQueued);
      calm_s_ = 0.0;
    } else if (calm_s_ > kCalm_s && wanted_ > least_) {
      --wanted_;
      calm_s_ = 0.0;
    }
  }

  std::unique_ptr<OpenAlContext> context_;
  std::optional<SourceQueue> queue_;
  ALenum format_ = AL_FORMAT_STEREO16;
  LPALCGETINTEGER64VSOFT get_64_ = nullptr;
  int wanted_ = 2, least_ = 2;
  bool playing_ = false;
  std::uint64_t interruptions_ = 0;
  double calm_s_ = 0.0, age_s_ = 0.0;
  double since_progress_s_ = 0.0, update_s_ = kPeriod_s;
  bool watches_connection_ = false;
  std::string name_;
};

}  // namespace

std::unique_ptr<AudioSink> open_live_sink(const AudioPerceptConfig& config, std::string& reason) {
  prepare_openal(config.layout, core::fifo_priority(core::ThreadRole::kAudio, config.servo_priority));
  const QuietStderr quiet;
  // Turns off HRTF and the output limiter: the sound is already filtered for a head where that is wanted, and
  // is within full scale. A limiter would only look ahead, 1.5 ms.
  constexpr ALCint kOutputLimiter = 0x199A;  // ALC_OUTPUT_LIMITER_SOFT, which some headers lack
  const std::array<ALCint, 7> attributes{ALC_FREQUENCY,
                                         static_cast<ALCint>(kSampleRate_Hz),
                                         ALC_HRTF_SOFT,
                                         ALC_FALSE,
                                         kOutputLimiter,
                                         ALC_FALSE,
                                         0};
  ALCdevice* device = alcOpenDevice(config.device.empty() ? nullptr : config.device.c_str());
  auto context = std::make_unique<OpenAlContext>(device, attributes.data());
  if (device == nullptr) {
    reason = config.device.empty() ? "no playback device opens"
                                   : "the playback device '" + config.device + "' does not open";
    return nullptr;
  }
  if (!*context) {
    reason = "the playback device opens but gives no context";
    return nullptr;
  }
  return std::make_unique<OpenAlSink>(std::move(context), config.layout);
}

}  // namespace phantom::audio_percept
