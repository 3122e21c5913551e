#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/teleop/coupling/bilateral.hpp"
#include "common/teleop/coupling/counterbalance.hpp"

namespace phantom::teleop {

/// Importance of a percept beside a bilateral law.
enum class PerceptRole {
  kHelpful,    ///< effective, but not needed
  kEssential,  ///< needed, because nothing else conveys vicinity
  kWeak        ///< cannot be told apart from the law's own feedback
};

/// A row of the thesis's Table 6.1: the importance of each percept for one law.
struct PerceptSet {
  const char* row;     ///< its name and what it stands for, such as "b1: SCTFB, balanced arm"
  PerceptRole haptic;  ///< HAVP: drag on the master
  PerceptRole audio;   ///< DFAP: the tone
  PerceptRole view;    ///< VADP: hit-zone views
  const char* reason;  ///< one sentence for the operator
};

/// Returns the row of a law and of what carries the slave's weight, which matters in case b alone: b1 is a
/// balanced arm; b2 one whose weight is felt, or which is counterbalanced automatically ("can improve with
/// electronic counter balancing"). Cases d1 and d2 are laws d and e. Source: Table 6.1 and section 6.11.1.
PerceptSet percept_set(BilateralLaw law, Counterbalance counterbalance) noexcept;

const char* name_of(PerceptRole role) noexcept;

/// Which percepts are rendered: a column of Table 6.1, or none.
struct PerceptChoice {
  bool drag = true, tone = true, views = true;
  bool automatic = false;  ///< the choice follows the law

  friend bool operator==(const PerceptChoice&, const PerceptChoice&) = default;
};

/// Number of the automatic choice; others are the sum of 1 (drag), 2 (tone) and 4 (views).
inline constexpr int kAllPercepts = 7, kAutomaticPercepts = 8;
/// Returns the choice of that number, 0 to kAutomaticPercepts; the automatic one is that beside `law`.
PerceptChoice percepts_of(int number, BilateralLaw law) noexcept;
/// Returns the automatic choice: all percepts that Table 6.1 has beside the law, which leaves out drag that
/// cannot be told apart from the law's own feedback (cases d and e).
PerceptChoice percepts_beside(BilateralLaw law) noexcept;

/// What percepts_from_name() allows, in words.
inline constexpr const char* kPerceptNames =
    "all, none, law (as Table 6.1 has it beside the law), or some of drag, tone and views: drag,tone";
/// Returns the choice's number.
std::optional<int> percepts_from_name(std::string_view name) noexcept;
/// Returns "drag, tone and views", or "no percept".
std::string words_of(const PerceptChoice& choice);

}  // namespace phantom::teleop
