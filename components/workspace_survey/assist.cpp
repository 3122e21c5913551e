#include "components/workspace_survey/assist.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <iterator>
#include <ostream>
#include <sstream>

#include "common/core/units.hpp"
#include "common/runtime/process/process.hpp"
#include "common/survey/error_aid.hpp"
#include "components/workspace_survey/assist_lines.hpp"
#include "components/workspace_survey/head/head_steering.hpp"

namespace phantom::workspace_survey {
namespace {

using survey::Reading;
using survey::Targeting;

constexpr double kAnotherFaceSigmas = 6.0;  // a corner farther off the plane of the others than errors go

class Assistant {
 public:
  Assistant(const Config& config, const Library& library, const AssistSetup& setup, std::istream& in,
            std::ostream& out)
      : config_(config), library_(library), setup_(setup), in_(in), out_(out) {
    if (setup.head != nullptr)
      steering_.emplace(*setup.head, config.head, config.errors, setup.readings, out);
  }

  int run() {
    out_ << "Survey of one object, with a library of " << library_.parts.size() << " parts.\n"
         << "Choose a plane face that you see whole, aim at its corners one after the other, "
            "either way round, and type what the\n"
            "head reads: range in mm, pan and tilt in degrees. End the face with: done. "
            "Type help for all else.\n";
    if (!setup_.practice.empty())
      out_
          << "Practice: an empty line lets the simulated head target the next corner, and ends a face after its "
             "last one.\n";
    for (std::string line; prompt(), std::getline(in_, line);) {
      std::istringstream words(line);
      std::string word;
      words >> word;
      if (word == "quit" || word == "exit") break;
      act(word, words, line);
    }
    out_ << '\n';
    return sent_ != runtime::kExitDone ? sent_ : fitted() ? runtime::kExitDone : runtime::kExitFailed;
  }

 private:
  /// Returns the face's name: A, B … Z, A1, B1 …
  std::string face_name() const {
    const std::size_t round = faces_done_ / 26;
    return fmt::format("{}{}", static_cast<char>('A' + faces_done_ % 26),
                       round == 0 ? "" : std::to_string(round));
  }
  void prompt() {
    if (setup_.on_prompt) setup_.on_prompt(view());
    out_ << "face " << face_name() << ", corner " << on_face_ + 1 << "> " << std::flush;
  }

  AssistView view() const {
    const survey::PoseFit* fit = best_fit();
    AssistView view = survey_view(
        config_.head, config_.errors, targetings_,
        fit == nullptr ? nullptr : &library_.models[result_.identification.candidates.front().part],
        fit == nullptr ? geometry::Pose() : fit->X_WO);
    view.face = face_name();
    view.corner = on_face_ + 1;
    view.fitted = fitted();
    if (steering_ && steering_->pointing())
      view.pointing = {steering_->pointing()->pan_rad, steering_->pointing()->tilt_rad};
    return view;
  }

  /// Returns the best pose of the part that agrees best; null: there is none yet.
  const survey::PoseFit* best_fit() const {
    const auto& found = result_.identification.candidates;
    const bool placed = !found.empty() && found.front().placements.front().fit;
    return placed ? &*found.front().placements.front().fit : nullptr;
  }

  void act(const std::string& word, std::istringstream& words, const std::string& line) {
    if (word == "help" || word == "?") {
      out_ << (steering_ ? kHeadHelp : "") << kHelp;
    } else if (steering_ && steer(word, words)) {
      return;
    } else if (word == "done" || word == "part") {
      end_face(word == "done");
    } else if (word == "undo") {
      undo();
    } else if (word == "show") {
      show();
    } else if (word == "again" || word == "more") {
      measure_again(word == "again", words);
    } else if (word == "save") {
      save(words);
    } else if (word == "pick") {
      pick(words);
    } else if (word == "send") {
      send();
    } else if (word.empty()) {
      practise();
    } else if (word.front() == '=') {
      take({face_name(), true, word.substr(1), std::nullopt, "typed"});
    } else if (const auto reading = reading_in(line)) {
      take({face_name(), true, std::to_string(next_node_), *reading, "typed"});
    } else {
      out_ << "  '" << word
           << "' is neither a word that I know nor a reading of three numbers (range in mm, "
              "pan and tilt in deg); help lists all\n";
    }
  }

  /// Does what a line says with the head. Returns false if it says nothing of it.
  bool steer(const std::string& word, std::istringstream& words) {
    if (word == "aim") {
      steering_->aim(words);
    } else if (word == "jog") {
      steering_->jog(words);
    } else if (word == "next") {
      aim_at_next();
    } else if (word == "measure") {
      if (const auto reading = steering_->measure())
        take({face_name(), true, std::to_string(next_node_), *reading, "measured"});
    } else {
      return false;
    }
    return true;
  }

  /// Turns the head to the next corner of this face, as the best candidate has it.
  void aim_at_next() {
    const survey::PoseFit* fit = best_fit();
    if (fit == nullptr) {
      out_ << "  no part is placed yet: aim at the corner yourself\n";
      return;
    }
    const survey::Candidate& best = result_.identification.candidates.front();
    const survey::PartModel& part = library_.models[best.part];
    if (on_face_ == 0) {
      const auto measurement = registered(complete());
      if (!measurement) return;
      planned_ = survey::plan_next_face(part, fit->X_WO, *measurement, best.placements.front().map);
      planned_names_.clear();
      for (const survey::MeasuredNode& node : measurement->nodes) planned_names_.push_back(node.name);
    }
    if (!planned_ || on_face_ >= planned_->corners.size()) {
      out_ << (planned_ ? std::string("  that was the last corner of this face that is seen; ") +
                              (planned_->closed ? "done" : "part") + " ends the face\n"
                        : "  all corners that the head sees are measured\n");
      return;
    }
    const survey::PlannedCorner& corner = planned_->corners[on_face_];
    out_ << fmt::format("  if it is {}: corner {} of {}{}\n", part.name, on_face_ + 1,
                        planned_->corners.size(),
                        corner.measured ? ", which is node " + planned_names_[*corner.measured] +
                                              ": type =" + planned_names_[*corner.measured]
                                        : "");
    if (!corner.measured && steering_->aim_at(corner.p_W_m))
      out_ << "  look where the spot is; jog it onto the corner, wholly on the face, before you measure\n";
  }

  /// Returns the registered nodes of the targetings. Prints what is wrong with them and returns none if they
  /// are refused.
  std::optional<survey::Measurement> registered(const std::vector<Targeting>& targetings) {
    auto measurement = survey::register_nodes(config_.head, config_.errors, targetings);
    if (measurement) return std::move(*measurement);
    out_ << "  refused: " << measurement.status().message() << '\n';
    return std::nullopt;
  }

  bool take(Targeting targeting) {
    auto all = targetings_;
    all.push_back(targeting);
    const auto measurement = registered(all);
    if (!measurement) return false;
    const auto node = std::find_if(measurement->nodes.begin(), measurement->nodes.end(),
                                   [&](const auto& n) { return n.name == targeting.node; });
    for (const survey::MeasuredNode& other : measurement->nodes) {
      const double apart_m = (other.p_W_m - node->p_W_m).norm();
      if (other.name == node->name || apart_m > 2 * survey::distance_sigma_m(other, *node)) continue;
      out_ << fmt::format(
          "  refused: that is {:.1f} mm from node {}, within the errors; "
          "is it the same corner? then type ={}\n",
          1e3 * apart_m, other.name, other.name);
      return false;
    }
    out_ << fmt::format("  node {}: ({:.4f}, {:.4f}, {:.4f}) m, known to {:.1f} mm\n", node->name,
                        node->p_W_m.x(), node->p_W_m.y(), node->p_W_m.z(),
                        1e3 * std::sqrt(node->covariance_m2.trace()));
    warn_of_another_face(*measurement, *node);
    targetings_ = std::move(all);
    if (targeting.reading && targeting.node == std::to_string(next_node_)) ++next_node_;
    ++on_face_;
    return true;
  }

  /// Asks whether a face's end was forgotten, if the others' corners so far are plane and this one is far
  /// off.
  void warn_of_another_face(const survey::Measurement& measurement, const survey::MeasuredNode& node) {
    const survey::MeasuredFace& face = measurement.faces.back();
    std::vector<std::size_t> others(face.nodes.begin(), face.nodes.end() - 1);
    if (on_face_ < 3 || others.size() < 3) return;
    const survey::Plane plane = survey::fit_plane(measurement, others);
    if (plane.degrees > 0 && survey::chi_square_tail(plane.chi2, plane.degrees) < survey::kSuspicion) return;
    const survey::Departure off = survey::departure_from(plane, node);
    if (std::abs(off.off_m) < kAnotherFaceSigmas * off.sigma_m) return;
    out_ << fmt::format(
        "  it lies {:.1f} mm off the plane of this face's other corners (errors: {:.1f} mm). If it is the first "
        "corner of\n  another face: undo, end this face with done or part, and target it again\n",
        1e3 * std::abs(off.off_m), 1e3 * off.sigma_m);
  }

  void end_face(bool whole) {
    if (on_face_ < (whole ? 3U : 2U)) {
      out_ << fmt::format("  {} corners so far; a {} needs at least {}\n", on_face_,
                          whole ? "whole face" : "part of a face", whole ? 3 : 2);
      return;
    }
    auto all = targetings_;
    for (Targeting& t : all) {
      if (t.face == face_name()) t.closed = whole;
    }
    const auto measurement = registered(all);
    if (!measurement) return;
    if (auto checked = survey::check_measurement(*measurement); !checked) {
      out_ << "  refused: " << checked.message() << "; undo corners, or measure them again\n";
      return;
    }
    targetings_ = std::move(all);
    ++faces_done_;
    on_face_ = 0;
    show();
    if (fitted()) {
      out_ << "A pose is found. A further face makes it surer; send tells the workspace; "
              "save FILE keeps the readings.\n";
    } else {
      out_ << "Go on with another face, or follow the advice.\n";
    }
  }

  void undo() {
    if (targetings_.empty()) {
      out_ << "  there is nothing to forget\n";
      return;
    }
    if (on_face_ == 0) {  // reopen the last face
      const std::string face = targetings_.back().face;
      --faces_done_;
      result_ = {};  // the result included that face
      for (Targeting& t : targetings_) {
        if (t.face != face) continue;
        t.closed = true;
        on_face_ += t.place != "more";
      }
    }
    const Targeting& last = targetings_.back();
    if (last.place == "practice" && next_shot_ > 0) --next_shot_;
    if (last.place != "more") --on_face_;
    if (last.place != "more" && last.reading && last.node == std::to_string(next_node_ - 1)) --next_node_;
    out_ << "  forgot node " << targetings_.back().node << " of face " << targetings_.back().face << '\n';
    targetings_.pop_back();
  }

  void measure_again(bool replace, std::istringstream& words) {
    std::string node, rest;
    words >> node;
    std::getline(words, rest);
    const bool by_head = steering_ && rest.find_first_not_of(" \t") == std::string::npos;
    const auto reading = by_head ? steering_->measure() : reading_in(rest);
    if (by_head && !reading) return;
    const auto first = std::find_if(targetings_.begin(), targetings_.end(),
                                    [&](const Targeting& t) { return t.node == node && t.reading; });
    if (!reading || first == targetings_.end()) {
      out_ << (reading ? "  no node '" + node + "' was measured\n"
                       : std::string("  needs a node and a reading: again NODE RANGE PAN TILT\n"));
      return;
    }
    auto all = targetings_;
    const auto at = all.begin() + (first - targetings_.begin());
    if (replace) {
      at->reading = *reading;
      all.erase(std::remove_if(at + 1, all.end(),
                               [&](const Targeting& t) { return t.node == node && t.place == "more"; }),
                all.end());
    } else {
      Targeting further = *at;
      further.reading = *reading;
      further.place = "more";
      all.insert(at + 1, further);
    }
    if (!registered(all)) return;
    targetings_ = std::move(all);
    out_ << "  node " << node << (replace ? " has the new reading\n" : " has one reading more\n");
    if (faces_done_ > 0) show();
  }

  /// Returns the targetings of complete faces.
  std::vector<Targeting> complete() const {
    std::vector<Targeting> whole;
    std::copy_if(targetings_.begin(), targetings_.end(), std::back_inserter(whole),
                 [&](const Targeting& t) { return t.face != face_name(); });
    return whole;
  }

  void show(std::size_t picked = 0) {
    const auto measurement = registered(complete());
    if (!measurement) return;
    survey::SurveyOptions options = config_.options;
    options.picked = picked;
    result_ = survey::survey_object(library_.models, *measurement, options);
    const SurveyReport report{config_, library_, *measurement, result_, setup_.voxel_size_m};
    const std::string alternatives = alternatives_text(report);
    out_ << measured_text(report) << candidates_text(report) << alternatives << fit_text(report);
    if (alternatives.empty()) return;
    out_ << "  measure more, or type pick and a number\n";
    if (setup_.show) out_ << setup_.show(report);
  }

  void pick(std::istringstream& words) {
    std::size_t number = 0;
    if (!(words >> number) || number == 0 || faces_done_ == 0) {
      out_ << (faces_done_ == 0 ? "  no face is complete yet\n"
                                : "  needs a number of those listed: pick N\n");
      return;
    }
    show(number);
  }

  bool fitted() const { return result_.object.has_value(); }

  void save(std::istringstream& words) {
    std::string file;
    words >> file;
    if (file.empty() || targetings_.empty() || !setup_.save) {
      out_ << (file.empty() ? "  needs a file's name: save FILE\n" : "  there is nothing to keep\n");
      return;
    }
    out_ << "  " << setup_.save(file, targetings_) << '\n';
  }

  void send() {
    if (!fitted() || !setup_.send) {
      out_ << (fitted() ? "  there is no workspace to tell\n"
                        : "  there is no accepted pose to send; nothing was sent\n");
      return;
    }
    const auto measurement = registered(complete());
    if (!measurement) return;
    const Sent sent = setup_.send({config_, library_, *measurement, result_, setup_.voxel_size_m});
    out_ << "  " << sent.message << '\n';
    sent_ = sent.exit_code;
  }

  void practise() {
    if (setup_.practice.empty()) return;
    if (is_at_end_of_practised_face()) return end_face(setup_.practice[next_shot_ - 1].closed);
    if (next_shot_ >= setup_.practice.size()) {
      out_ << "  the simulated head has shown all that it sees of the part\n";
      return;
    }
    const Targeting& shot = setup_.practice[next_shot_];
    if (shot.reading) {
      out_ << fmt::format("  the head reads {:.1f} {:.4f} {:.4f}\n", 1e3 * shot.reading->range_m,
                          shot.reading->pan_rad / core::kRadPerDegree,
                          shot.reading->tilt_rad / core::kRadPerDegree);
    } else {
      out_ << "  the corner is node " << shot.node << " again\n";
    }
    if (!take({face_name(), true, shot.node, shot.reading, "practice"})) return;
    ++next_shot_;
    if (is_at_end_of_practised_face())
      out_ << "  that was the last corner of this face that is seen; an empty line, or "
           << (shot.closed ? "done" : "part") << ", ends the face\n";
  }

  /// Whether the simulated head has targeted a face to its end, and the face was not ended yet.
  bool is_at_end_of_practised_face() const {
    return on_face_ > 0 && next_shot_ > 0 && targetings_.back().place == "practice" &&
           (next_shot_ == setup_.practice.size() ||
            setup_.practice[next_shot_].face != setup_.practice[next_shot_ - 1].face);
  }

  const Config& config_;
  const Library& library_;
  const AssistSetup& setup_;
  std::istream& in_;
  std::ostream& out_;
  std::optional<HeadSteering> steering_;
  std::optional<survey::PlannedFace> planned_;  // the face that next goes along
  std::vector<std::string> planned_names_;      // of the nodes measured when it was planned
  std::vector<Targeting> targetings_;
  survey::SurveyResult result_;
  int sent_ = runtime::kExitDone;  // the last send's exit code
  std::size_t faces_done_ = 0, on_face_ = 0, next_node_ = 1, next_shot_ = 0;
};

}  // namespace

int assist(const Config& config, const Library& library, const AssistSetup& setup, std::istream& in,
           std::ostream& out) {
  return Assistant(config, library, setup, in, out).run();
}

}  // namespace phantom::workspace_survey
