// A cautious person reaches for the bar with each row of table 6.1 and the percepts that the table has beside
// it: what the hand feels before contact, how it touches, and since when it has heard the bar. Then one who
// heeds the tone and the views as well.

#include <algorithm>
#include <array>
#include <cmath>

#include "common/percept/closeness.hpp"
#include "common/percept/tone.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "tests/experiments/arms/bar_rig.hpp"
#include "tests/experiments/arms/teleop_rig.hpp"

namespace phantom::experiments {
namespace in_percept_sets {
namespace {

using teleop::BilateralLaw;
using teleop::Counterbalance;

constexpr double kAim_deg = 43.0;  // three degrees into the bar
constexpr double kReach_s = 1.5;
constexpr double kInverse_a = 0.004;  // of law b, as in `coworking`: the weight is felt, a contact as well
constexpr double kImpulse_s = 0.1;    // from the first touch

struct Row {
  const char* name;
  BilateralLaw law;
  Counterbalance counterbalance;
};
constexpr std::array<Row, 7> kRows{{{"a", BilateralLaw::kPf, Counterbalance::kMechanical},
                                    {"b1", BilateralLaw::kSctfb, Counterbalance::kMechanical},
                                    {"b2", BilateralLaw::kSctfb, Counterbalance::kNone},
                                    {"b2 cb", BilateralLaw::kSctfb, Counterbalance::kAutomatic},
                                    {"c", BilateralLaw::kPfff, Counterbalance::kMechanical},
                                    {"d1", BilateralLaw::kPe, Counterbalance::kMechanical},
                                    {"d2", BilateralLaw::kPeff, Counterbalance::kMechanical}}};

struct Measured {
  double background_Nm = 0.0;  // greatest of the slave's feedback, where nothing really stands
  double drag_Nm = 0.0;        // greatest of the percept's torque then
  double touch_deg_s = 0.0, impulse_Ns = 0.0;  // at the bar
  double heard_s = 0.0;                        // from the tone's beginning to the contact
  double heeded_deg_s = 0.0;                   // speed at the bar of a person who hears and sees
};

TeleopSetup setup_of(const Row& row, const char* hand, const Settings& settings) {
  TeleopSetup setup = teleop_setup(settings, hand, teleop::name_of(row.law));
  setup.master.percepts = teleop::kAutomaticPercepts;
  setup.slave.plant.balanced = row.counterbalance == Counterbalance::kMechanical;
  setup.slave.gravity_feed_forward = row.counterbalance == Counterbalance::kAutomatic;
  setup.master.feedback.inverse_a[static_cast<std::size_t>(BilateralLaw::kSctfb)] =
      teleop::everywhere(kInverse_a);
  set_swing(setup, rad(kAim_deg), kReach_s);
  return setup;
}

/// The reach, from its start on.
std::vector<Moment> reach(const TeleopSetup& setup, const Settings& settings) {
  TeleopRig rig(setup, settings);
  Moment now;
  while (!(now = rig.step()).swinging) {
  }
  std::vector<Moment> moments;
  const double start_s = now.t_s;
  while (moments.size() < 4000) {
    moments.push_back(rig.step());
    moments.back().t_s -= start_s;
  }
  return moments;
}

/// Speed at the bar's first touch, °/s; 0: it is not touched.
double touch_deg_s(const std::vector<Moment>& moments) {
  const auto touch = std::find_if(moments.begin(), moments.end(), [](const Moment& m) { return m.contact; });
  if (touch == moments.end() || touch == moments.begin()) return 0.0;
  return degrees((touch - 1)->slave_rad_s);
}

/// The same of a person who hears and sees, in row d1, which has no drag, with these percepts.
double heeded_deg_s(const char* percepts, const Settings& settings) {
  TeleopSetup setup = setup_of(kRows[5], "attentive", settings);
  setup.master.percepts = teleop::percepts_from_name(percepts).value();
  return touch_deg_s(reach(setup, settings));
}

/// With which this arm's weight is felt as that of a heavy arm.
constexpr double kHeavyInverse_a = 0.1;

/// Share of the time with drag in which the product reports it masked, where nothing is touched.
double masked_share(const Row& row, const Settings& settings) {
  TeleopSetup setup = setup_of(row, "minimum_jerk", settings);
  setup.master.percepts = teleop::kAllPercepts;
  setup.master.feedback.inverse_a[static_cast<std::size_t>(BilateralLaw::kSctfb)] =
      teleop::everywhere(kHeavyInverse_a);
  clamp_percept(setup, kThesisClamp_Nm);
  setup.cell.objects.front().X_deviation.translation_m = {10.0, 0.0, 0.0};
  int dragged = 0, masked = 0;
  for (const Moment& m : reach(setup, settings)) {
    if (std::abs(m.pffb_Nm) <= setup.master.masking.drag_floor_Nm[setup.joint]) continue;
    ++dragged;
    masked += m.masked ? 1 : 0;
  }
  return dragged > 0 ? static_cast<double>(masked) / dragged : -1.0;
}

Measured measure(const Row& row, const Settings& settings) {
  Measured found;
  TeleopSetup setup = setup_of(row, "minimum_jerk", settings);
  setup.cell.objects.front().X_deviation.translation_m = {10.0, 0.0, 0.0};
  for (const Moment& m : reach(setup, settings)) {
    found.background_Nm = std::max(found.background_Nm, std::abs(m.sffb_Nm));
    found.drag_Nm = std::max(found.drag_Nm, std::abs(m.pffb_Nm));
  }
  setup = setup_of(row, "cautious", settings);
  const auto moments = reach(setup, settings);
  const double greatest_mu = percept::greatest_neighbour_mu(setup.workspace);
  const auto touch = std::find_if(moments.begin(), moments.end(), [](const Moment& m) { return m.contact; });
  const auto heard = std::find_if(moments.begin(), moments.end(), [&](const Moment& m) {
    return percept::tone_of({}, percept::closeness(m.mu, greatest_mu), 0.0).gain > 0.0;
  });
  if (touch == moments.end() || touch == moments.begin() || heard == moments.end()) return found;
  found.touch_deg_s = touch_deg_s(moments);
  found.heeded_deg_s = touch_deg_s(reach(setup_of(row, "attentive", settings), settings));
  found.heard_s = touch->t_s - heard->t_s;
  for (auto at = touch; at != moments.end() && at->t_s < touch->t_s + kImpulse_s; ++at)
    found.impulse_Ns += 0.001 * at->force_N;
  return found;
}

void run(Report& report, const Settings& settings) {
  Table& table =
      report.table("rows", {"row", "feedback in free space [N·m]", "drag [N·m]", "touch [°/s]",
                            "impulse [N·s]", "heard before [s]", "touch of a heedful person [°/s]"});
  std::array<Measured, kRows.size()> rows;
  std::vector<std::string> names;
  double heard_s = 1e9;
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    const Measured& m = rows[i] = measure(kRows[i], settings);
    table.row({static_cast<double>(i), m.background_Nm, m.drag_Nm, m.touch_deg_s, m.impulse_Ns, m.heard_s,
               m.heeded_deg_s});
    names.emplace_back(kRows[i].name);
    heard_s = std::min(heard_s, m.heard_s);
  }
  Plot& plot = report.plot(
      "rows",
      "A cautious person reaches for the bar in each row of table 6.1, with the percepts of the row\n"
      "b2: the arm's weight is felt; b2 cb: it is counterbalanced by the arm's model",
      2);
  plot.panel("does drag stand apart?", "row", "greatest torque on the hand [N·m]")
      .series(table, "row", "feedback in free space [N·m]", "slave's feedback, nothing there", Style::kBars)
      .series(table, "row", "drag [N·m]", "drag near the modelled bar", Style::kBars)
      .names_x(names);
  plot.panel("contact", "row", "speed at contact [°/s]")
      .series(table, "row", "touch [°/s]", "a person who feels", Style::kBars)
      .series(table, "row", "touch of a heedful person [°/s]", "who feels, hears and sees", Style::kBars)
      .names_x(names);
  const auto &b1 = rows[1], &heavy = rows[2], &light = rows[3], &d1 = rows[5], &d2 = rows[6];
  // The weight is felt all the way, beside the friction and inertia that b1 has, too.
  report.check("b2 ÷ b1: feedback in free space", heavy.background_Nm / b1.background_Nm, 2.0, 20.0, "");
  report.check("b2 counterbalanced ÷ b2: feedback in free space", light.background_Nm / heavy.background_Nm,
               0.0, 0.7, "");
  for (const std::size_t i : {0, 1, 3, 4})
    report.check(std::string(kRows[i].name) + ": feedback in free space ÷ drag",
                 rows[i].background_Nm / rows[i].drag_Nm, 0.0, 0.1, "");
  // "Percept does not stand apart": what the law itself gives in free space is as great.
  report.check("d1: feedback in free space ÷ drag of row a", d1.background_Nm / rows[0].drag_Nm, 0.4, 5.0,
               "");
  report.check("b2 counterbalanced ÷ b1: speed at contact", light.touch_deg_s / b1.touch_deg_s, 0.9, 1.1, "");
  report.check("d1, d2: drag beside the law", d1.drag_Nm + d2.drag_Nm, 0.0, 0.0, "N·m");
  double slowest_without = std::min(d1.touch_deg_s, d2.touch_deg_s), fastest_with = 0.0;
  for (const std::size_t with : {0, 1, 3, 4}) fastest_with = std::max(fastest_with, rows[with].touch_deg_s);
  report.check("speed at contact: greatest with drag ÷ least without (d1, d2)",
               fastest_with / slowest_without, 0.05, 0.5, "");
  report.check("every row: the bar is heard before it is touched", heard_s, 0.3, 10.0, "s");
  // With no percept of her own she is the cautious person; tone and views help each alone.
  const double deaf = heeded_deg_s("none", settings), by_tone = heeded_deg_s("tone", settings),
               by_views = heeded_deg_s("views", settings);
  report.check("d1, percepts off: heedful ÷ cautious person, speed at contact", deaf / d1.touch_deg_s, 0.9,
               1.1, "");
  report.check("d1, tone alone ÷ percepts off: speed at contact", by_tone / deaf, 0.02, 0.6, "");
  // A view opens with the threat, later than the tone begins; the eyes need longer. In a reach of 1.5 s it
  // helps little.
  report.check("d1, views alone ÷ percepts off: speed at contact", by_views / deaf, 0.02, 0.95, "");
  report.check("d1, d2: speed at contact by tone and views ÷ without heeding them",
               std::max(d1.heeded_deg_s / d1.touch_deg_s, d2.heeded_deg_s / d2.touch_deg_s), 0.02, 0.6, "");
  // The drag of row a is the same; what masks it is the weight, and where it is carried nothing does.
  Table& masking = report.table("masking", {"row", "masked share"});
  std::array<double, kRows.size()> shares{};
  for (std::size_t i = 0; i < kRows.size(); ++i)
    masking.row({static_cast<double>(i), shares[i] = masked_share(kRows[i], settings)});
  plot.panel("does the product report masked drag?", "row", "share of the time with drag")
      .series(masking, "row", "masked share", "rows b: 1/A = 0.1; drag up to 0.22 N·m", Style::kBars)
      .range_y(0.0, 1.0)
      .names_x(names);
  report.check("b2, 1/A = 0.1: share of the time with drag in which the weight masks it", shares[2], 0.4, 1.0,
               "");
  report.check("b2 counterbalanced ÷ b2: the same share", shares[3] / shares[2], 0.0, 0.6, "");
  report.check("a, b1, c: the same share", std::max({shares[0], shares[1], shares[4]}), 0.0, 0.0, "");
  report.prints_no_more("table 6.1 (page 226) and section 6.11 (pages 224 to 233) judge the rows in words.");
  report.difference(
      "The thesis judges the rows in words, and prints no gains. With the shipped ones, and 1/A = 0.004, the weight in row "
      "b2 stands behind the drag as a tenth of it: it does not mask it, as the thesis's heavier arm does. "
      "With 1/A = 0.1 and the clamp of figure 5.24 it does, and master_io says so (last panel). "
      "How fast a person reacts to a tone or a view, and how slowly she goes on, are the simulation's (0.2 and 0.35 s; 0.15 of her pace), not the thesis's.");
}

}  // namespace
}  // namespace in_percept_sets

Experiment percept_sets() {
  return {
      "percept-sets",
      "The rows of table 6.1",
      "table 6.1, section 6.11",
      "Drag is effective with a balanced arm; an unbalanced one's weight is felt behind it, which electronic "
      "counterbalancing improves; with position exchange the law's own drag is as great, so tone and views serve alone.",
      {Sabotage::kConstantMu, Sabotage::kIgnoredSpeed, Sabotage::kWeightless, Sabotage::kSilence},
      in_percept_sets::run};
}

}  // namespace phantom::experiments
