#pragma once

#include <vector>

#include "common/core/status.hpp"

namespace phantom::percept {

/// One of the parallel bypass pipes of a multiple pass cylinder.
struct MpcPipe {
  double diameter_m = 0.0;  ///< d_i
  double length_m = 0.0;    ///< l_i
  double gap_m =
      0.0;  ///< G_i: the part of the stroke on which this pipe and those before it in the list are open
};

/// A multiple pass cylinder (spec 1.1, thesis eqs. 3.1–3.11 with the spec's errata): a piston pushes fluid
/// out through bypass pipes that fall out of the loop one after the other, so that it meets more resistance
/// the nearer it comes to the cylinder's end, which touches the object.
struct MpcDesign {
  double cylinder_diameter_m = 0.0;   ///< D
  double fluid_viscosity_Pa_s = 0.0;  ///< μ_f
  std::vector<MpcPipe> pipes;         ///< the one that stays open longest, next to the object, first
};

enum class MpcTransition {
  kStepped,      ///< γ changes where a pipe falls out of the loop
  kInterpolated  ///< γ_i holds in the middle of its gap and changes linearly to the next one's
};

/// What a piston meets, from the object outwards.
struct MpcLayers {
  std::vector<int> thickness_vox;
  std::vector<double> gamma_N_s_per_m;  ///< falling; same length
};

/// Whether the design can be built; the message says what is wrong and what is allowed.
core::Status check_mpc(const MpcDesign& design);

/// Flow resistance of a pipe, laminar (Hagen–Poiseuille): ρ = 128 μ_f l / (π d⁴), Pa·s/m³.
double pipe_resistance_Pa_s_per_m3(const MpcPipe& pipe, double fluid_viscosity_Pa_s);

/// γ_1 … γ_n with 1 … n pipes open: γ_n = A² / Σ_{i ≤ n} 1/ρ_i, N·s/m; the opposing force is F = v·γ. The
/// design must be checked.
std::vector<double> mpc_gamma_N_s_per_m(const MpcDesign& design);

/// γ at a distance from the object along the stroke; 0 beyond the stroke. The design must be checked.
double mpc_gamma_at(const MpcDesign& design, double distance_m, MpcTransition transition);

/// The design in whole voxels: gap i becomes k_i = G_i / voxel size voxels, rounded. Interpolated, every
/// voxel along the stroke gets a layer of its own, with γ as at the middle of the voxel; neighbours with the
/// same γ are one layer. Refuses a design that cannot be built and a gap of less than half a voxel.
core::Expected<MpcLayers> mpc_layers(const MpcDesign& design, double voxel_size_m, MpcTransition transition);

}  // namespace phantom::percept
