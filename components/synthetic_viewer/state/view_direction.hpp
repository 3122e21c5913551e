#pragma once

#include "components/synthetic_viewer/state/localized_text.hpp"
#include "components/synthetic_viewer/state/synthetic_viewer.hpp"

namespace phantom::synthetic_viewer {

/// Returns from where a node looks, as an operator in front of the main view says it: "from the upper left".
/// `main_azimuth_rad`: azimuth in W of the main view's default camera, from x towards y. "by itself" for
/// kAutomatic. Pure.
LocalizedText direction_words(ViewNode node, double main_azimuth_rad);

}  // namespace phantom::synthetic_viewer
