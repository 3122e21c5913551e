#include <spdlog/spdlog.h>

#include <cmath>

#include "common/geometry/implicit/formula.hpp"
#include "common/percept/mpc.hpp"
#include "common/runtime/cell/cell_parts.hpp"
#include "common/workspace/thin_layers.hpp"

namespace phantom::runtime {
namespace {

/// Layers outside the body, the nearest first.
struct Layers {
  std::vector<int> thickness_vox;
  std::vector<double> mu;
};

Layers read_list(const Fields& fields) {
  Layers layers;
  fields.numbers("thickness_vox", layers.thickness_vox);
  fields.numbers("mu_Pa_s_per_m", layers.mu);
  fields.check(layers.mu.size() == layers.thickness_vox.size(), "mu_Pa_s_per_m",
               "has " + std::to_string(layers.mu.size()) + " layers, thickness_vox has " +
                   std::to_string(layers.thickness_vox.size()) + "; allowed: the same number");
  return layers;
}

/// Reads the name of a set of viscosities that the thesis uses (section 4.8 and chapter 5).
Layers read_set(const Fields& fields) {
  Layers layers;
  fields.choice("set", layers.mu,
                {{"linear", {32, 29, 26, 23, 20, 17, 14, 11, 8, 5}},
                 {"nonlinear", {32, 20, 13, 11, 10, 9, 8}},
                 {"nonlinear_gentle", {32, 25, 20, 17, 15, 13}},
                 {"nonlinear_short", {32, 20, 13, 11, 10, 8}}});
  int layer_vox = 4;
  fields.number("layer_vox", layer_vox);
  layers.thickness_vox.assign(layers.mu.size(), layer_vox);
  return layers;
}

Layers read_mpc(const Fields& fields, double reference_m) {
  const Fields mpc = fields.section("mpc");
  percept::MpcDesign design;
  mpc.number("cylinder_diameter_m", design.cylinder_diameter_m);
  mpc.number("fluid_viscosity_Pa_s", design.fluid_viscosity_Pa_s);
  for (const Fields& pipe : mpc.sections("pipes"))
    design.pipes.push_back({pipe.value("diameter_m"), pipe.value("length_m"), pipe.value("gap_m")});
  using enum percept::MpcTransition;
  auto gamma = kStepped;
  mpc.choice("gamma", gamma, {{"stepped", kStepped}, {"interpolated", kInterpolated}});
  const auto layers = percept::mpc_layers(design, reference_m, gamma);
  if (!layers) throw fields.error("mpc", layers.status().message());
  // With μ_n = γ_n the fluid resists like the cylinder (eq. 4.7).
  for (std::size_t i = 0; i < layers->gap_m.size(); ++i) {
    const double wanted_m = design.pipes[i].gap_m, actual_m = layers->gap_m[i];
    if (std::abs(actual_m - wanted_m) > 1e-6 * wanted_m)
      spdlog::info("{}: the gap of pipe {} is {:g} m instead of {:g} m: gaps are whole voxels of {:g} m",
                   mpc.place(), i + 1, actual_m, wanted_m, reference_m);
  }
  return {layers->thickness_vox, layers->gamma_N_s_per_m};
}

Layers read_function(const Fields& function, double reference_m) {
  const auto formula = geometry::Formula::parse(function.text("mu"), {"d"});
  if (!formula) throw function.error("mu", "is not a formula of d: " + formula.status().message());
  int thickness_vox = 1;
  function.number("layer_vox", thickness_vox);
  const double layer_m = thickness_vox * reference_m, most_m = workspace::kMaxLayers * layer_m,
               reach_m = function.value("reach_m");
  function.check(reach_m >= layer_m && reach_m <= most_m, "reach_m",
                 "is out of range; allowed: " + std::to_string(layer_m) + " to " + std::to_string(most_m) +
                     " m (98 layers at most)");
  Layers layers;
  for (double d = 0.5 * layer_m; d < reach_m; d += layer_m) {
    const double mu = formula->value(std::span(&d, 1));
    const std::string value = std::isfinite(mu) ? "gives " + std::to_string(mu) : std::string("has no value");
    const std::string place = value + " at d = " + std::to_string(d) + " m";
    function.check(std::isfinite(mu) && mu >= 1e-6 && mu <= 1e6, "mu",
                   place + "; allowed: 1e-6 to 1e6 Pa·s/m");
    function.check(
        layers.mu.empty() || mu < layers.mu.back(), "mu",
        place + ", which is not less than nearer to the object; allowed: a function that falls with d");
    layers.mu.push_back(mu);
    layers.thickness_vox.push_back(thickness_vox);
  }
  return layers;
}

Layers read_layers(const Fields& fields, double reference_m) {
  const std::string kind = fields.one_of("function");
  if (kind == "set") return read_set(fields);
  if (kind == "mpc") return read_mpc(fields, reference_m);
  return kind == "function" ? read_function(fields.section(kind), reference_m) : read_list(fields);
}

void check_falling(const Fields& fields, const std::vector<float>& mu) {
  for (std::size_t i = 1; i < mu.size(); ++i)
    fields.check(mu[i] < mu[i - 1], "mu_Pa_s_per_m",
                 "does not fall outwards at layer " + std::to_string(i + 1) +
                     "; allowed: each layer less than the one nearer to the object");
}

}  // namespace

void check_in_voxels(const Fields& fields, const workspace::LayerProfile& profile,
                     const workspace::VoxelSize& size) {
  if (const auto checked = workspace::check_profile(profile); !checked)
    throw ConfigError(fields.place() + ": " + checked.message());
  if (const auto checked = workspace::check_layers(profile, size); !checked)
    throw ConfigError(fields.place() + ": " + checked.message());
}

workspace::LayerProfile read_profile(const Fields& fields, const workspace::VoxelSize& size) {
  const Layers layers = read_layers(fields, size.reference_m());
  workspace::LayerProfile profile;
  profile.thickness_vox = layers.thickness_vox;
  profile.mu_Pa_s_per_m.assign(layers.mu.begin(), layers.mu.end());
  check_falling(fields, profile.mu_Pa_s_per_m);
  const float greatest = layers.mu.empty() ? 0.0F : profile.mu_Pa_s_per_m.front();
  profile.mu_skin_Pa_s_per_m = std::max(100.0F, greatest);
  fields.number("mu_skin_Pa_s_per_m", profile.mu_skin_Pa_s_per_m);
  fields.check(profile.mu_skin_Pa_s_per_m >= greatest, "mu_skin_Pa_s_per_m",
               "is below the first layer's; allowed: at least that");
  fields.number("guard_vox", profile.guard_vox);
  using enum workspace::LayerMethod;
  fields.choice("method", profile.method,
                {{"distance", kDistance}, {"surface", kSurface}, {"dilation", kDilation}});
  fields.check(!fields.has("element") || profile.method == kDilation, "element",
               "belongs to method: dilation; allowed: leave it out");
  using enum workspace::ShapingElement;
  fields.choice("element", profile.element,
                {{"cube", kCube}, {"sphere", kSphere}, {"sphere-contained", kSphereContained}});
  if (fields.has("inside")) {
    const Fields inside = fields.section("inside");
    inside.numbers("thickness_vox", profile.inside_thickness_vox);
    std::vector<double> mu;
    inside.numbers("mu_Pa_s_per_m", mu);
    profile.mu_inside_Pa_s_per_m.assign(mu.begin(), mu.end());
    inside.numbers("stiffness_Pa_per_m", profile.stiffness_inside_Pa_per_m);
  }
  check_in_voxels(fields, profile, size);
  for (const std::string& note : workspace::thin_layer_notes(profile, size))
    spdlog::warn("{}: {}", fields.place(), note);
  return profile;
}

}  // namespace phantom::runtime
