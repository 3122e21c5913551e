#include "common/percept/noticeable_steps.hpp"

#include "common/core/text.hpp"

namespace phantom::percept {
namespace {

/// A place on the way into a body.
struct Stratum {
  std::string name;
  double mu_Pa_s_per_m;
};

std::vector<Stratum> strata_inwards(const workspace::LayerProfile& profile) {
  std::vector<Stratum> strata;
  for (std::size_t n = profile.mu_Pa_s_per_m.size(); n > 0; --n)
    strata.push_back({"layer " + std::to_string(n), profile.mu_Pa_s_per_m[n - 1]});
  const auto& inside = profile.mu_inside_Pa_s_per_m;
  strata.push_back({"boundary", inside.empty() ? profile.mu_skin_Pa_s_per_m : inside.front()});
  for (std::size_t n = 2; n <= inside.size(); ++n)  // the boundary has the viscosity of layer −1
    strata.push_back({"layer -" + std::to_string(n), inside[n - 1]});
  if (!inside.empty()) strata.push_back({"interior", profile.mu_skin_Pa_s_per_m});
  return strata;
}

}  // namespace

std::vector<LayerStep> layer_steps(const workspace::LayerProfile& profile, double medium_mu_Pa_s_per_m) {
  std::vector<Stratum> strata = strata_inwards(profile);
  if (medium_mu_Pa_s_per_m > 0.0) strata.insert(strata.begin(), {"medium", 0.0});
  std::vector<LayerStep> steps;
  for (std::size_t i = 1; i < strata.size(); ++i) {
    const double outer = strata[i - 1].mu_Pa_s_per_m + medium_mu_Pa_s_per_m,
                 inner = strata[i].mu_Pa_s_per_m + medium_mu_Pa_s_per_m;
    steps.push_back({strata[i - 1].name, strata[i].name, outer, inner, inner / outer - 1.0});
  }
  return steps;
}

std::vector<std::string> unnoticed_steps(const workspace::LayerProfile& profile, double weber_fraction,
                                         double medium_mu_Pa_s_per_m) {
  constexpr double kRounding = 1e-5;  // of a profile's single precision
  std::vector<std::string> steps;
  for (const LayerStep& step : layer_steps(profile, medium_mu_Pa_s_per_m)) {
    if (step.fraction >= weber_fraction * (1.0 - kRounding)) continue;
    steps.push_back(core::formatted("from %s to %s (%g to %g Pa·s/m, %.1f %%)", step.outer.c_str(),
                                    step.inner.c_str(), step.outer_mu_Pa_s_per_m, step.inner_mu_Pa_s_per_m,
                                    100.0 * step.fraction));
  }
  return steps;
}

}  // namespace phantom::percept
