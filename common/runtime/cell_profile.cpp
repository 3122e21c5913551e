#include <algorithm>
#include <cmath>

#include "common/geometry/formula.hpp"
#include "common/percept/mpc.hpp"
#include "common/runtime/cell_parts.hpp"

namespace phantom::runtime {
namespace {

constexpr Range kMu{1e-6, 1e6, "Pa·s/m"};
constexpr Range kThickness{1, 1000, "voxels"};

/// Layers outside the body, the nearest first.
struct Layers {
  std::vector<int> thickness_vox;
  std::vector<double> mu;
};

struct NamedSet {
  const char* name;
  std::vector<double> mu;
};

/// Returns the sets of viscosities that the thesis uses (section 4.8 and chapter 5).
const std::vector<NamedSet>& named_sets() {
  static const std::vector<NamedSet> sets = {{"linear", {32, 29, 26, 23, 20, 17, 14, 11, 8, 5}},
                                             {"nonlinear", {32, 20, 13, 11, 10, 9, 8}},
                                             {"nonlinear_gentle", {32, 25, 20, 17, 15, 13}},
                                             {"nonlinear_short", {32, 20, 13, 11, 10, 8}}};
  return sets;
}

Layers read_list(const ConfigReader& reader) {
  const Layers layers{reader.integers("thickness_vox", kThickness), reader.numbers("mu_Pa_s_per_m", kMu)};
  if (layers.mu.size() != layers.thickness_vox.size()) {
    throw reader.error("mu_Pa_s_per_m",
                       "has " + std::to_string(layers.mu.size()) + " layers, thickness_vox has " +
                           std::to_string(layers.thickness_vox.size()) + "; allowed: the same number");
  }
  return layers;
}

Layers read_set(const ConfigReader& reader) {
  const std::string name = reader.text("set");
  std::string known;
  for (const NamedSet& set : named_sets()) {
    if (name == set.name)
      return {std::vector<int>(set.mu.size(), reader.integer("layer_vox", 4, kThickness)), set.mu};
    known += (known.empty() ? "" : ", ") + std::string(set.name);
  }
  throw reader.error("set", "is not known; allowed: " + known);
}

Layers read_mpc(const ConfigReader& reader, double voxel_size_m) {
  const ConfigReader mpc = reader.section("mpc");
  percept::MpcDesign design;
  design.cylinder_diameter_m = mpc.number("cylinder_diameter_m", {1e-6, 1e3, "m"});
  design.fluid_viscosity_Pa_s = mpc.number("fluid_viscosity_Pa_s", {1e-9, 1e9, "Pa·s"});
  for (const ConfigReader& pipe : mpc.sections("pipes")) {
    design.pipes.push_back({pipe.number("diameter_m", {1e-6, 1e3, "m"}),
                            pipe.number("length_m", {1e-6, 1e3, "m"}),
                            pipe.number("gap_m", {1e-6, 1e3, "m"})});
  }
  const bool stepped = mpc.choice("gamma", "stepped", {"stepped", "interpolated"}) == "stepped";
  const auto layers =
      percept::mpc_layers(design, voxel_size_m,
                          stepped ? percept::MpcTransition::kStepped : percept::MpcTransition::kInterpolated);
  if (!layers) throw reader.error("mpc", layers.status().message());
  return {layers->thickness_vox,
          layers->gamma_N_s_per_m};  // with μ_n = γ_n the fluid resists like the cylinder (eq. 4.7)
}

Layers read_function(const ConfigReader& reader, double voxel_size_m) {
  const ConfigReader function = reader.section("function");
  const auto formula = geometry::Formula::parse(function.text("mu"), {"d"});
  if (!formula) throw function.error("mu", "is not a formula of d: " + formula.status().message());
  const int thickness_vox = function.integer("layer_vox", 1, kThickness);
  const double layer_m = thickness_vox * voxel_size_m;
  const double reach_m =
      function.number("reach_m", {layer_m, workspace::kMaxLayers * layer_m, "m (98 layers at most)"});
  Layers layers;
  for (double d = 0.5 * layer_m; d < reach_m; d += layer_m) {
    const double mu = formula->value(std::span(&d, 1));
    const std::string value = std::isfinite(mu) ? "gives " + std::to_string(mu) : std::string("has no value");
    const std::string place = value + " at d = " + std::to_string(d) + " m";
    if (!(std::isfinite(mu) && mu >= kMu.min && mu <= kMu.max))
      throw function.error("mu", place + "; allowed: 1e-6 to 1e6 Pa·s/m");
    if (!layers.mu.empty() && !(mu < layers.mu.back()))
      throw function.error(
          "mu",
          place + ", which is not less than nearer to the object; allowed: a function that falls with d");
    layers.mu.push_back(mu);
    layers.thickness_vox.push_back(thickness_vox);
  }
  return layers;
}

Layers read_layers(const ConfigReader& reader, double voxel_size_m) {
  std::string found;
  for (const char* key : {"mu_Pa_s_per_m", "set", "mpc", "function"}) {
    if (!reader.has(key)) continue;
    if (!found.empty())
      throw reader.error(key,
                         "stands beside " + found + "; allowed: one of mu_Pa_s_per_m, set, mpc, function");
    found = key;
  }
  if (found == "set") return read_set(reader);
  if (found == "mpc") return read_mpc(reader, voxel_size_m);
  if (found == "function") return read_function(reader, voxel_size_m);
  return read_list(reader);
}

void check_falling(const ConfigReader& reader, const std::vector<double>& mu) {
  for (std::size_t i = 1; i < mu.size(); ++i) {
    if (static_cast<float>(mu[i]) < static_cast<float>(mu[i - 1])) continue;
    throw reader.error("mu_Pa_s_per_m", "does not fall outwards at layer " + std::to_string(i + 1) +
                                            "; allowed: each layer less than the one nearer to the object");
  }
}

workspace::LayerMethod read_method(const ConfigReader& reader) {
  const std::string name = reader.choice("method", "distance", {"distance", "surface", "dilation"});
  return name == "surface"    ? workspace::LayerMethod::kSurface
         : name == "dilation" ? workspace::LayerMethod::kDilation
                              : workspace::LayerMethod::kDistance;
}

workspace::ShapingElement read_element(const ConfigReader& reader, workspace::LayerMethod method) {
  if (reader.has("element") && method != workspace::LayerMethod::kDilation)
    throw reader.error("element", "belongs to method: dilation; allowed: leave it out");
  const std::string name = reader.choice("element", "sphere", {"cube", "sphere", "sphere-contained"});
  return name == "cube"     ? workspace::ShapingElement::kCube
         : name == "sphere" ? workspace::ShapingElement::kSphere
                            : workspace::ShapingElement::kSphereContained;
}

}  // namespace

workspace::LayerProfile read_profile(const ConfigReader& reader, double voxel_size_m) {
  const Layers layers = read_layers(reader, voxel_size_m);
  workspace::LayerProfile profile;
  profile.thickness_vox = layers.thickness_vox;
  profile.mu_Pa_s_per_m.assign(layers.mu.begin(), layers.mu.end());
  check_falling(reader, layers.mu);
  const double greatest = layers.mu.empty() ? 0.0 : layers.mu.front();
  profile.mu_skin_Pa_s_per_m =
      static_cast<float>(reader.number("mu_skin_Pa_s_per_m", std::max(100.0, greatest), kMu));
  if (!layers.mu.empty() && profile.mu_skin_Pa_s_per_m < profile.mu_Pa_s_per_m.front())
    throw reader.error("mu_skin_Pa_s_per_m", "is below the first layer's; allowed: at least that");
  profile.guard_vox = reader.integer("guard_vox", 0, {0, 100, "voxels"});
  profile.method = read_method(reader);
  profile.element = read_element(reader, profile.method);
  if (reader.has("inside")) {
    const ConfigReader inside = reader.section("inside");
    profile.inside_thickness_vox = inside.integers("thickness_vox", kThickness);
    const auto mu = inside.numbers("mu_Pa_s_per_m", kMu);
    profile.mu_inside_Pa_s_per_m.assign(mu.begin(), mu.end());
  }
  if (const auto checked = workspace::check_profile(profile); !checked)
    throw ConfigError(reader.place() + ": " + checked.message());
  return profile;
}

}  // namespace phantom::runtime
