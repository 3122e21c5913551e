#pragma once

#include <iosfwd>
#include <memory>
#include <string>

#include "components/workspace_survey/assist_view.hpp"

namespace phantom::workspace_survey {

extern const char* const kSurveyPage;    ///< survey.html
extern const char* const kSurveyScript;  ///< survey.js
extern const char* const kSurveyStyle;   ///< survey.css

/// The assistant's dialogue on a page in a browser: what the person types there, or asks for by its buttons,
/// are lines of the dialogue, and the page shows its words, where the head points, what was measured and the
/// part that agrees best. It is served to this host alone, under an address with a random key that only who
/// started it knows:
///   GET  /KEY/                the page, with survey.js, survey.css and tokens.css beside it
///   GET  /KEY/state?seen=N    the state, as soon as it is newer than number N; 204 after a second without
///   GET  /KEY/candidates      the page of candidates (candidates_page()); 404 while there is none
///   POST /KEY/line            {"line": "jog 0.1 0"}: 409 while an earlier line is carried out
/// The assistant's thread reads lines() and writes words(); any thread may do the rest.
class SurveyPage {
 public:
  /// Starts to serve at 127.0.0.1:`port`, 0: any free one. All words go to `terminal`, too. Throws
  /// core::MissingError if the port cannot be had.
  SurveyPage(int port, std::ostream& terminal);
  ~SurveyPage();
  SurveyPage(const SurveyPage&) = delete;
  SurveyPage& operator=(const SurveyPage&) = delete;

  /// The address, with its key, such as "http://127.0.0.1:8090/0123…/".
  const std::string& url() const;
  /// The person's lines. Reading waits for one.
  std::istream& lines();
  std::ostream& words();
  /// Shows where the dialogue stands, from its next wait for a line on.
  void show(const AssistView& view);
  void show_candidates(std::string html);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::workspace_survey
