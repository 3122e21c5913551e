#include "components/audio_percept/spatialiser.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "common/runtime/process/process.hpp"
#include "components/audio_percept/audio_percept.hpp"
#include "components/audio_percept/openal.hpp"

namespace phantom::audio_percept {
namespace {

// Silence before the signal, so that the queues never run dry between two calls: a source that stops and
// starts again loses its filters' memory. It is longer than the look-ahead of OpenAL's resamplers.
constexpr std::size_t kLeadFrames = 32;

ALCint channels_of(Layout layout) {
  return layout == Layout::k5_1   ? ALC_5POINT1_SOFT
         : layout == Layout::k7_1 ? ALC_7POINT1_SOFT
                                  : ALC_STEREO_SOFT;
}

std::unique_ptr<OpenAlContext> open_loopback(Layout layout) {
  prepare_openal(layout);
  const QuietStderr quiet;
  const auto open =
      reinterpret_cast<LPALCLOOPBACKOPENDEVICESOFT>(alcGetProcAddress(nullptr, "alcLoopbackOpenDeviceSOFT"));
  const std::array<ALCint, 9> attributes{ALC_FORMAT_CHANNELS_SOFT,
                                         channels_of(layout),
                                         ALC_FORMAT_TYPE_SOFT,
                                         ALC_FLOAT_SOFT,
                                         ALC_FREQUENCY,
                                         static_cast<ALCint>(kSampleRate_Hz),
                                         ALC_HRTF_SOFT,
                                         layout == Layout::kHrtf ? ALC_TRUE : ALC_FALSE,
                                         0};
  auto context =
      std::make_unique<OpenAlContext>(open != nullptr ? open(nullptr) : nullptr, attributes.data());
  const std::string option = std::string("output.channels: ") + name_of(layout) + ": ";
  if (!*context) throw runtime::MissingError(option + "OpenAL cannot render this; allowed without it: mono");
  ALCint hrtf = ALC_FALSE;
  alcGetIntegerv(context->device(), ALC_HRTF_SOFT, 1, &hrtf);
  if ((hrtf == ALC_TRUE) != (layout == Layout::kHrtf)) {
    throw runtime::MissingError(option +
                                (layout == Layout::kHrtf
                                     ? "OpenAL finds no HRTF data set for 48 kHz (Debian: libopenal-data)"
                                     : "OpenAL's configuration forces HRTF"));
  }
  return context;
}

/// A signal fed into OpenAL. Each call takes out of the queue as much as it puts in.
struct Feed {
  SourceQueue queue{4};

  Feed() { add(std::array<float, kLeadFrames>{}); }
  void place(const Vector3& p) {
    alSource3f(queue.source(), AL_POSITION, static_cast<float>(p[0]), static_cast<float>(p[1]),
               static_cast<float>(p[2]));
  }
  void add(std::span<const float> samples) {
    queue.reclaim();
    queue.add(AL_FORMAT_MONO_FLOAT32, std::as_bytes(samples));
    if (queue.queued() > 1) queue.play();
  }
};

}  // namespace

struct Spatialiser::OpenAl {
  OpenAl(Layout layout, double near_m)
      : context(open_loopback(layout)),
        render(reinterpret_cast<LPALCRENDERSAMPLESSOFT>(
            alcGetProcAddress(context->device(), "alcRenderSamplesSOFT"))) {
    const OpenAlContext::Use use(*context);
    alDistanceModel(AL_NONE);  // only the direction is rendered; loudness stands for speed alone
    percept.emplace();
    alarm.emplace();
    if (alIsExtensionPresent("AL_EXT_SOURCE_RADIUS") == AL_TRUE)
      alSourcef(percept->queue.source(), AL_SOURCE_RADIUS, static_cast<float>(near_m));
    alarm->place({0.0, 0.0, -1.0});
  }
  ~OpenAl() {
    const OpenAlContext::Use use(*context);
    percept.reset();
    alarm.reset();
  }
  std::unique_ptr<OpenAlContext> context;
  LPALCRENDERSAMPLESSOFT render;
  std::optional<Feed> percept, alarm;
};

Spatialiser::Spatialiser(Layout layout, double near_m)
    : openal_(layout == Layout::kMono ? nullptr : std::make_unique<OpenAl>(layout, near_m)) {}
Spatialiser::~Spatialiser() = default;

double Spatialiser::delay_s() const noexcept {
  return openal_ == nullptr ? 0.0 : static_cast<double>(kLeadFrames) / kSampleRate_Hz;
}

void Spatialiser::render(std::span<const float> percept, std::span<const float> alarm,
                         const Vector3& p_listener_m, std::span<float> frames) noexcept {
  if (openal_ == nullptr) {
    std::transform(percept.begin(), percept.end(), alarm.begin(), frames.begin(), std::plus<>());
  } else {
    const OpenAlContext::Use use(*openal_->context);
    openal_->percept->place(p_listener_m);
    openal_->percept->add(percept);
    openal_->alarm->add(alarm);
    openal_->render(openal_->context->device(), frames.data(), static_cast<ALCsizei>(percept.size()));
  }
  for (float& sample : frames) sample = std::clamp(sample, -1.0F, 1.0F);
}

}  // namespace phantom::audio_percept
