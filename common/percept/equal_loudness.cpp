#include "common/percept/equal_loudness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace phantom::percept {
namespace {

/// A row of table 1 of ISO 226:2003.
struct Row {
  double frequency_Hz;
  double exponent;      // α_f, exponent of loudness perception
  double transfer_dB;   // L_U, linear transfer function normalised at 1 kHz
  double threshold_dB;  // T_f, threshold of hearing
};
constexpr std::array<Row, 29> kTable{{
    {20, 0.532, -31.6, 78.5},    {25, 0.506, -27.2, 68.7},   {31.5, 0.480, -23.0, 59.5},
    {40, 0.455, -19.1, 51.1},    {50, 0.432, -15.9, 44.0},   {63, 0.409, -13.0, 37.5},
    {80, 0.387, -10.3, 31.5},    {100, 0.367, -8.1, 26.5},   {125, 0.349, -6.2, 22.1},
    {160, 0.330, -4.5, 17.9},    {200, 0.315, -3.1, 14.4},   {250, 0.301, -2.0, 11.4},
    {315, 0.288, -1.1, 8.6},     {400, 0.276, -0.4, 6.2},    {500, 0.267, 0.0, 4.4},
    {630, 0.259, 0.3, 3.0},      {800, 0.253, 0.5, 2.2},     {1000, 0.250, 0.0, 2.4},
    {1250, 0.246, -2.7, 3.5},    {1600, 0.244, -4.1, 1.7},   {2000, 0.243, -1.0, -1.3},
    {2500, 0.243, 1.7, -4.2},    {3150, 0.243, 2.5, -6.0},   {4000, 0.242, 1.2, -5.4},
    {5000, 0.242, -2.1, -1.5},   {6300, 0.245, -7.1, 6.0},   {8000, 0.254, -11.2, 12.6},
    {10000, 0.271, -10.7, 13.9}, {12500, 0.301, -3.1, 12.3},
}};

double level_of_row_dB(const Row& row, double phon) noexcept {
  const double at_threshold =
      std::pow(0.4 * std::pow(10.0, (row.threshold_dB + row.transfer_dB) / 10.0 - 9.0), row.exponent);
  const double a = 4.47e-3 * (std::pow(10.0, 0.025 * phon) - 1.15) + at_threshold;
  return 10.0 / row.exponent * std::log10(a) - row.transfer_dB + 94.0;
}

}  // namespace

double equal_loudness_level_dB(double frequency_Hz, double phon) noexcept {
  phon = std::clamp(phon, kMinPhon, kMaxPhon);
  frequency_Hz = std::clamp(frequency_Hz, kTable.front().frequency_Hz, kTable.back().frequency_Hz);
  const auto above = std::find_if(kTable.begin() + 1, kTable.end() - 1,
                                  [&](const Row& row) { return row.frequency_Hz >= frequency_Hz; });
  const Row &high = *above, &low = *(above - 1);
  const double share =
      std::log(frequency_Hz / low.frequency_Hz) / std::log(high.frequency_Hz / low.frequency_Hz);
  return std::lerp(level_of_row_dB(low, phon), level_of_row_dB(high, phon), share);
}

double greatest_equal_loudness_level_dB(double low_Hz, double high_Hz, double phon) noexcept {
  double greatest = std::max(equal_loudness_level_dB(low_Hz, phon), equal_loudness_level_dB(high_Hz, phon));
  for (const Row& row : kTable) {
    if (row.frequency_Hz > low_Hz && row.frequency_Hz < high_Hz)
      greatest = std::max(greatest, level_of_row_dB(row, std::clamp(phon, kMinPhon, kMaxPhon)));
  }
  return greatest;
}

}  // namespace phantom::percept
