#include "common/teleop/rendering/percept_set.hpp"

#include <array>
#include <utility>

namespace phantom::teleop {
namespace {

using enum PerceptRole;

constexpr int kDrag = 1, kTone = 2, kViews = 4;

PerceptSet slave_torque_set(Counterbalance counterbalance) noexcept {
  switch (counterbalance) {
    case Counterbalance::kNone:
      return {"b2: SCTFB, weight felt", kHelpful, kEssential, kEssential,
              "the arm's weight is felt all the time and masks the drag: listen, look, or counterbalance it"};
    case Counterbalance::kAutomatic:
      return {"b2: SCTFB, counterbalanced", kEssential, kHelpful, kHelpful,
              "the gravity model carries the arm's weight: drag before contact, the slave's torque in it"};
    case Counterbalance::kMechanical:
      break;
  }
  return {"b1: SCTFB, balanced arm", kEssential, kHelpful, kHelpful,
          "drag before contact, the slave's torque in contact"};
}

}  // namespace

PerceptSet percept_set(BilateralLaw law, Counterbalance counterbalance) noexcept {
  constexpr const char* kLagHides =
      "the slave's lag drags on the hand everywhere, so drag does not stand apart";
  switch (law) {
    case BilateralLaw::kPf:
      return {"a: position forward", kEssential, kHelpful, kHelpful,
              "drag is the only feedback there is; the tone tells of slow approaches"};
    case BilateralLaw::kSctfb:
      return slave_torque_set(counterbalance);
    case BilateralLaw::kPfff:
      return {"c: measured force", kEssential, kHelpful, kHelpful,
              "drag before contact, the measured force in contact"};
    case BilateralLaw::kPe:
      return {"d1: position exchange", kWeak, kEssential, kEssential, kLagHides};
    case BilateralLaw::kPeff:
      return {"d2: position exchange and measured force", kWeak, kEssential, kEssential, kLagHides};
  }
  return {"", kEssential, kEssential, kEssential, ""};
}

const char* name_of(PerceptRole role) noexcept {
  constexpr std::array kNames{"helpful", "essential", "weak"};
  return kNames[static_cast<std::size_t>(role)];
}

PerceptChoice percepts_beside(BilateralLaw law) noexcept {
  const PerceptSet set = percept_set(law, Counterbalance::kMechanical);  // who is weak is so with any weight
  return {set.haptic != kWeak, set.audio != kWeak, set.view != kWeak, true};
}

PerceptChoice percepts_of(int number, BilateralLaw law) noexcept {
  if (number == kAutomaticPercepts) return percepts_beside(law);
  return {(number & kDrag) != 0, (number & kTone) != 0, (number & kViews) != 0, false};
}

std::optional<int> percepts_from_name(std::string_view name) noexcept {
  constexpr std::array<std::pair<std::string_view, int>, 4> kWhole{
      {{"all", kAllPercepts}, {"none", 0}, {"law", kAutomaticPercepts}, {"automatic", kAutomaticPercepts}}};
  constexpr std::array<std::pair<std::string_view, int>, 3> kParts{
      {{"drag", kDrag}, {"tone", kTone}, {"views", kViews}}};
  for (const auto& [word, number] : kWhole) {
    if (name == word) return number;
  }
  int number = 0;
  for (bool more = true; more;) {
    const std::size_t comma = name.find(',');
    const std::string_view part = name.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) name.remove_prefix(comma + 1);
    int bit = 0;
    for (const auto& [word, value] : kParts) bit = part == word ? value : bit;
    if (bit == 0 || (number & bit) != 0) return std::nullopt;
    number |= bit;
  }
  return number;
}

std::string words_of(const PerceptChoice& choice) {
  std::string words;
  const auto add = [&words](bool on, const char* word, bool last) {
    if (on) words += (words.empty() ? "" : last ? " and " : ", ") + std::string(word);
  };
  add(choice.drag, "drag", false);
  add(choice.tone, "tone", !choice.views);
  add(choice.views, "views", true);
  return words.empty() ? "no percept" : words;
}

}  // namespace phantom::teleop
