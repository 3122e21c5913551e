// What the operator hears on the way to a plate, at rest before it, and at several speeds within one layer:
// the rendered sound's frequency and level against the laws (thesis 6.5, figure 6.13).

#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>

#include "common/geometry/implicit/primitives.hpp"
#include "common/percept/closeness.hpp"
#include "components/audio_percept/render.hpp"
#include "tests/experiments/rig.hpp"

namespace phantom::experiments {
namespace in_audio {
namespace {

constexpr double kVoxel_m = 0.005;
constexpr int kLayer_vox = 4;
constexpr double kLayer_m = kVoxel_m * kLayer_vox;
const std::vector<float> kMu{32, 20, 13, 11, 10, 8};
constexpr double kApproach_m_s = 0.04, kPercept_s = 0.01;  // percepts come at 100 Hz
constexpr double kStill_s = 1.0, kSpeedStep_s = 0.5;
const std::vector<double> kSpeeds_m_s{0.0, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25};

/// What is sensed at one time: distance to the plate, μ there and the speed.
struct Sensed {
  double t_s, distance_m, mu, speed_m_s;
};

/// A stretch of the track within which distance's layer and speed are constant.
struct Stretch {
  double from_s, to_s, distance_m, speed_m_s;
};

/// Approach at constant speed, standstill, then speeds within the third layer (the sensor moves along the
/// plate).
std::vector<Sensed> track(const workspace::Workspace& workspace, const Settings& settings,
                          std::vector<Stretch>& stretches) {
  Probe probe(workspace, settings);
  std::vector<Sensed> sensed;
  double t_s = 0.0;
  const auto sense = [&](double distance_m, double speed_m_s) {
    sensed.push_back({t_s, distance_m,
                      probe.at({-distance_m, 0.0, 0.0}, Eigen::Vector3d::Zero()).mu_Pa_s_per_m,
                      sabotaged(speed_m_s, settings.sabotage)});
    t_s += kPercept_s;
  };
  const double start_m = static_cast<double>(kMu.size() + 1) * kLayer_m, end_m = 0.5 * kVoxel_m;
  for (double distance_m = start_m; distance_m > end_m; distance_m -= kApproach_m_s * kPercept_s)
    sense(distance_m, kApproach_m_s);
  for (std::size_t layer = 0; layer < kMu.size(); ++layer) {
    const double middle_m = (static_cast<double>(layer) + 0.5) * kLayer_m;
    const double at_s = (start_m - middle_m) / kApproach_m_s;
    stretches.push_back({at_s - 0.1, at_s + 0.1, middle_m, kApproach_m_s});
  }
  const auto stay = [&](double distance_m, double speed_m_s, double duration_s) {
    stretches.push_back({t_s + 0.15, t_s + duration_s - 0.05, distance_m, speed_m_s});
    for (const double end_s = t_s + duration_s; t_s < end_s - 1e-9;) sense(distance_m, speed_m_s);
  };
  stay(end_m, 0.0, kStill_s);
  for (const double speed_m_s : kSpeeds_m_s) stay(2.5 * kLayer_m, speed_m_s, kSpeedStep_s);
  return sensed;
}

void write_csv(const std::vector<Sensed>& sensed, double greatest_mu, const std::filesystem::path& file) {
  std::ofstream csv(file);
  csv.precision(9);
  csv << "t,closeness,speed_m_s,x_m,y_m,z_m\n";
  for (const Sensed& s : sensed)
    csv << s.t_s << ',' << percept::closeness(s.mu, greatest_mu) << ',' << s.speed_m_s << ',' << -s.distance_m
        << ",0,0\n";
  if (!csv.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

std::vector<double> read_wav(const std::filesystem::path& file) {
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, int (*)(SNDFILE*)> wav(sf_open(file.c_str(), SFM_READ, &info), sf_close);
  if (!wav || info.channels != 1 || info.samplerate != 48000)
    throw std::runtime_error(file.string() + ": not mono at 48 kHz");
  std::vector<double> samples(static_cast<std::size_t>(info.frames));
  sf_readf_double(wav.get(), samples.data(), info.frames);
  return samples;
}

constexpr double kRate_Hz = 48000.0;

/// A sine as it was heard within a stretch.
struct Heard {
  double frequency_Hz = 0.0, gain = 0.0;
};

/// Frequency by the rising zero crossings, amplitude by the mean square.
Heard hear(const std::vector<double>& samples, double from_s, double to_s) {
  double first = 0.0, last = 0.0, square = 0.0, count = 0.0;
  int crossings = 0;
  const auto to = static_cast<std::size_t>(to_s * kRate_Hz);
  for (auto i = static_cast<std::size_t>(from_s * kRate_Hz); i < to; ++i, count += 1.0) {
    square += samples[i] * samples[i];
    if (!(samples[i - 1] < 0.0 && samples[i] >= 0.0)) continue;
    last = static_cast<double>(i) - samples[i] / (samples[i] - samples[i - 1]);
    if (crossings++ == 0) first = last;
  }
  return {(crossings - 1) * kRate_Hz / (last - first), std::sqrt(2.0 * square / count)};
}

/// What the laws of the configuration say, by their formulas: exponential pitch, power law of level
/// (audio_percept.yaml).
Heard by_the_law(const percept::ToneLaw& law, double mu, double greatest_mu, double speed_m_s) {
  const double closeness = std::min(1.0, mu / greatest_mu);
  const double f = law.min_frequency_Hz * std::pow(law.max_frequency_Hz / law.min_frequency_Hz, closeness);
  const double share = std::min(1.0, speed_m_s / law.full_speed_m_s);
  const double gain = law.rest_gain + (law.full_gain - law.rest_gain) * std::pow(share, law.speed_exponent);
  return {f, gain * percept::loudness_factor(law, f)};
}

double mu_at(double distance_m) {
  const auto layer = static_cast<std::size_t>(distance_m / kLayer_m);
  return layer < kMu.size() ? static_cast<double>(kMu[layer]) : 0.0;
}

/// Frequency from rising zero crossing to rising zero crossing, by time.
std::vector<std::pair<double, double>> pitch_over_time(const std::vector<double>& samples, double to_s) {
  std::vector<std::pair<double, double>> pitch;
  double last = -1.0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(to_s * kRate_Hz); ++i) {
    if (!(samples[i - 1] < 0.0 && samples[i] >= 0.0)) continue;
    const double at = static_cast<double>(i) - samples[i] / (samples[i] - samples[i - 1]);
    if (last >= 0.0) pitch.emplace_back(0.5 * (at + last) / kRate_Hz, kRate_Hz / (at - last));
    last = at;
  }
  return pitch;
}

/// How far from the layers' edges the pitch steps on the way in, at worst; metres.
double worst_step_place_m(const std::vector<double>& samples, const percept::ToneLaw& law,
                          double greatest_mu) {
  const double start_m = static_cast<double>(kMu.size() + 1) * kLayer_m;
  const auto pitch = pitch_over_time(samples, start_m / kApproach_m_s);
  double worst_m = 0.0;
  for (std::size_t layer = 0; layer + 1 < kMu.size(); ++layer) {
    const double inner_Hz = by_the_law(law, static_cast<double>(kMu[layer]), greatest_mu, 0.0).frequency_Hz;
    const double outer_Hz =
        by_the_law(law, static_cast<double>(kMu[layer + 1]), greatest_mu, 0.0).frequency_Hz;
    const auto step = std::find_if(pitch.begin(), pitch.end(),
                                   [&](const auto& p) { return p.second > std::sqrt(inner_Hz * outer_Hz); });
    if (step == pitch.end()) return std::nan("");
    const double at_m = start_m - kApproach_m_s * step->first,
                 edge_m = static_cast<double>(layer + 1) * kLayer_m;
    worst_m = std::max(worst_m, std::abs(at_m - edge_m));
  }
  return worst_m;
}

/// Greatest second difference of the samples ÷ the greatest that gliding sines of the percepts around can
/// have, a·(2πf/rate)², and the rounding to 16 bits. A click is above 1 by far.
double worst_corner(const std::vector<double>& samples, const std::vector<Sensed>& sensed,
                    const percept::ToneLaw& law, double greatest_mu) {
  constexpr auto kAround = static_cast<std::size_t>(0.03 / kPercept_s);  // longer than smoothing and period
  std::vector<Heard> tones;
  for (const Sensed& s : sensed) {
    tones.push_back(by_the_law(law, s.mu, greatest_mu, s.speed_m_s));
    if (s.mu <= 0.0) tones.back() = {law.min_frequency_Hz, 0.0};
  }
  double worst = 0.0;
  for (std::size_t i = 2; i < samples.size(); ++i) {
    const auto now =
        std::min(static_cast<std::size_t>(static_cast<double>(i) / kRate_Hz / kPercept_s), tones.size() - 1);
    double gain = 0.0, f_Hz = 0.0;
    for (std::size_t k = now - std::min(now, kAround); k < std::min(now + kAround, tones.size()); ++k) {
      gain = std::max(gain, tones[k].gain);
      f_Hz = std::max(f_Hz, tones[k].frequency_Hz);
    }
    const double step = 2.0 * std::numbers::pi * f_Hz / kRate_Hz, rounding = 2.0 / 32767.0;
    const double corner = std::abs(samples[i] - 2.0 * samples[i - 1] + samples[i - 2]);
    worst = std::max(worst, corner / (gain * step * step + rounding));
  }
  return worst;
}

void plot_laws(Report& report, const percept::ToneLaw& law, double greatest_mu,
               const std::vector<Stretch>& stretches, const std::vector<Heard>& heard) {
  Table& pitch = report.table("pitch", {"μ [Pa·s/m]", "heard [Hz]"});
  Table& level = report.table("level", {"speed [m/s]", "heard"});
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (i < kMu.size()) pitch.row({static_cast<double>(kMu[i]), heard[i].frequency_Hz});
    if (i > kMu.size()) level.row({stretches[i].speed_m_s, heard[i].gain});
  }
  Table& pitch_law = report.table("pitch_law", {"μ [Pa·s/m]", "law [Hz]"});
  for (double mu = 6.0; mu <= 32.0; mu += 0.5)
    pitch_law.row({mu, by_the_law(law, mu, greatest_mu, 0.0).frequency_Hz});
  Table& level_law = report.table("level_law", {"speed [m/s]", "law"});
  for (double v = 0.0; v <= 0.2501; v += 0.0025)
    level_law.row({v, by_the_law(law, mu_at(2.5 * kLayer_m), greatest_mu, v).gain});
  Plot& plot = report.plot(
      "laws",
      "Rendered sound against its laws: six layers of 2 cm with μ = 32, 20, 13, 11, 10, 8 Pa·s/m\n"
      "220 … 1760 Hz exponential in μ; level 0.08 … 0.6 with the root of speed, equally loud (ISO 226, "
      "60 phon)",
      2);
  plot.panel("closeness: pitch (figure 6.13 b)", "μ [Pa·s/m]", "frequency [Hz]")
      .series(pitch_law, "μ [Pa·s/m]", "law [Hz]", "law")
      .series(pitch, "μ [Pa·s/m]", "heard [Hz]", "in the WAV", Style::kPoints)
      .log_y();
  plot.panel("speed: level in the third layer (figure 6.13 a)", "speed [m/s]", "amplitude [full scale]")
      .series(level_law, "speed [m/s]", "law", "law")
      .series(level, "speed [m/s]", "heard", "in the WAV", Style::kPoints);
}

void plot_approach(Report& report, const percept::ToneLaw& law, double greatest_mu,
                   const std::vector<double>& samples) {
  const double start_m = static_cast<double>(kMu.size() + 1) * kLayer_m, end_s = start_m / kApproach_m_s;
  Table& table = report.table("approach", {"distance [mm]", "heard [Hz]", "law [Hz]"});
  for (const auto& [t_s, f_Hz] : pitch_over_time(samples, end_s)) {
    const double distance_m = start_m - kApproach_m_s * t_s;
    table.row({1000.0 * distance_m, f_Hz, by_the_law(law, mu_at(distance_m), greatest_mu, 0.0).frequency_Hz});
  }
  report
      .plot("approach",
            "Pitch on the way to the plate at 40 mm/s, from one zero crossing of the WAV to the next\n"
            "six layers of 2 cm with μ = 32, 20, 13, 11, 10, 8 Pa·s/m, percepts at 100 Hz")
      .panel("", "distance from the plate [mm]", "frequency [Hz]")
      .series(table, "distance [mm]", "law [Hz]", "law", Style::kStep)
      .series(table, "distance [mm]", "heard [Hz]", "in the WAV")
      .log_y();
}

void run(Report& report, const Settings& settings) {
  const auto profile = layers(kMu, kLayer_vox);
  const geometry::Pose X_WB{Eigen::Matrix3d::Identity(), {0.5 * kVoxel_m, 0.0, 0.0}};
  layers::Body plate{.name = "plate",
                     .mesh_W = geometry::make_box({kVoxel_m, 0.2, 0.2}).transformed(X_WB),
                     .profile = profile};
  const auto workspace =
      activate({plate}, layers::grid_over({-0.16, -0.05, -0.05}, {0.02, 0.05, 0.05}, kVoxel_m), settings);
  const double greatest_mu = percept::greatest_neighbour_mu(workspace);
  std::vector<Stretch> stretches;
  const auto sensed = track(workspace, settings, stretches);

  const auto config =
      audio_percept::load_config(settings.source_dir / "components/audio_percept/audio_percept.yaml");
  std::filesystem::create_directories(report.folder());
  const auto csv = report.folder() / "sensed.csv", wav = report.folder() / "sound.wav";
  write_csv(sensed, greatest_mu, csv);
  audio_percept::run_render(
      {.input = csv, .out = wav, .spectrogram = report.folder() / "spectrogram.png", .channels = "mono"},
      config);
  report.picture("spectrogram.png",
                 "The rendered sound: approach at 40 mm/s, a second at rest before the plate, "
                 "then 0 to 0.25 m/s within the third layer");
  const auto samples = read_wav(wav);

  std::vector<Heard> heard;
  double off_semitones = 0.0, off_dB = 0.0;
  for (const Stretch& stretch : stretches) {
    heard.push_back(hear(samples, stretch.from_s, stretch.to_s));
    const Heard law = by_the_law(config.law, mu_at(stretch.distance_m), static_cast<double>(kMu.front()),
                                 stretch.speed_m_s);
    off_semitones =
        std::max(off_semitones, std::abs(12.0 * std::log2(heard.back().frequency_Hz / law.frequency_Hz)));
    off_dB = std::max(off_dB, std::abs(20.0 * std::log10(heard.back().gain / law.gain)));
  }
  plot_laws(report, config.law, greatest_mu, stretches, heard);
  plot_approach(report, config.law, greatest_mu, samples);
  double free_space = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(0.9 * kLayer_m / kApproach_m_s * kRate_Hz); ++i)
    free_space = std::max(free_space, std::abs(samples[i]));

  // The ear tells a twentieth of a semitone and a third of a decibel at best; a sine of 200 ms is measured
  // far more finely.
  report.check("pitch follows μ: greatest deviation from the law", off_semitones, 0.0, 0.02, "semitones");
  report.check("level follows speed: greatest deviation from the law", off_dB, 0.0, 0.1, "dB");
  // 10 ms between percepts, 5 ms of a sound period, 10 ms of smoothing, at 40 mm/s.
  report.check("pitch steps at the layers' edges: greatest distance",
               1000.0 * worst_step_place_m(samples, config.law, greatest_mu), 0.0, 1.5, "mm");
  report.check("at rest before the plate: amplitude ÷ that at 0.25 m/s of the same pitch",
               heard[kMu.size() + 1].gain / heard.back().gain, 0.1, 0.2, "");
  report.check("free space: greatest amplitude", free_space, 0.0, 0.0, "full scale");
  // Half as much again, since level and pitch glide at the same time. A jump of 1 % of full scale would be
  // above 2.
  report.check("no clicks: greatest second difference ÷ that of the gliding sine",
               worst_corner(samples, sensed, config.law, greatest_mu), 0.1, 1.5, "");
  report.prints_no_more(
      "section 6.5 (pages 202 to 205) states no frequency, level or speed but \"minimum gain value is one\", the unit of its own "
      "amplitude.");
  report.difference(
      "The thesis draws the two drivers of figure 6.13 as blocks without laws. "
      "Ours codes μ exponentially, so that equal steps of closeness are equal intervals, "
      "and makes all pitches equally loud (ISO 226).");
}

}  // namespace
}  // namespace in_audio

Experiment audio() {
  return {"audio",
          "The tone that the operator hears",
          "figure 6.13",
          "The tone's frequency conveys closeness, also at rest; "
          "its level conveys speed and has a minimum above zero; silence in free space alone.",
          {Sabotage::kConstantMu, Sabotage::kLayersOffByOne, Sabotage::kIgnoredSpeed, Sabotage::kGrownBodies},
          in_audio::run};
}

}  // namespace phantom::experiments
