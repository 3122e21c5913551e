#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace phantom::geometry {

enum class UpAxis : std::uint8_t { kX, kY, kZ };

/// Who says so: the caller's options, the file (or its format's standard), or a guess.
enum class KnownFrom : std::uint8_t { kCaller, kFile, kGuess };

/// What a mesh file tells about its own coordinates; empty where it tells nothing.
struct DeclaredFrame {
  std::optional<double> scale;  ///< metres per unit
  std::optional<UpAxis> up;
};

/// A guess, and why, in words for a warning.
struct UnitGuess {
  double scale = 1.0;  ///< metres per unit: 1 or 0.001
  std::string why;
};

/// Largest object of a manipulator's cell that a guess takes for real, m.
inline constexpr double kGreatestPlausibleExtent_m = 20.0;

/// Metres, unless the mesh would then be larger than kGreatestPlausibleExtent_m: millimetres. `extents`: of
/// the mesh's box along x, y, z in its own units, finite. Pure; not real-time safe.
UnitGuess guess_unit(const std::array<double, 3>& extents);

/// Up-axis that tools which write this format mostly use. `format`: the importer's name of it.
UpAxis guess_up(std::string_view format);

/// "metres" for 1, "millimetres" for 0.001 and so on; "0.3 m" for what has no name.
std::string unit_name(double scale);

/// What the head of a text format declares: COLLADA's asset/unit/up_axis, AMF's and 3MF's unit attribute,
/// OpenGEX's metrics, DXF's $INSUNITS, by `format`. `head`: the file's (or the archive member's) first bytes;
/// whatever they hold, the answer is just empty if nothing is understood. Pure; not real-time safe.
DeclaredFrame declared_in_text(std::string_view format, std::string_view head);

/// Name of a 3MF package's root model in the package, as its relationships (the text of _rels/.rels) have it;
/// empty if nothing is understood. Pure; not real-time safe.
std::string root_model_of_3mf(std::string_view relationships);

}  // namespace phantom::geometry
