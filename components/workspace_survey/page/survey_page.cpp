#include "components/workspace_survey/page/survey_page.hpp"

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <istream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <ostream>
#include <streambuf>

#include "common/core/units.hpp"
#include "common/runtime/configuration/role_secrets.hpp"
#include "common/web/broadcast.hpp"
#include "common/web/page_access.hpp"
#include "common/web/page_requests.hpp"
#include "common/web/request_gate.hpp"

namespace phantom::workspace_survey {

extern const char* const kTokensCss;  // common/design

namespace {

using nlohmann::json;

constexpr std::size_t kKeyOctets = 16;
constexpr std::size_t kMaxLine = 300;       // a file's name is the longest word
constexpr std::size_t kMaxWords = 1 << 16;  // of the dialogue that the page shows
constexpr std::chrono::milliseconds kPatience{1000};

json degrees(const AssistView::Direction& direction) {
  return {{"pan_deg", direction.pan_rad / core::kRadPerDegree},
          {"tilt_deg", direction.tilt_rad / core::kRadPerDegree}};
}

json view_json(const AssistView& view) {
  json nodes = json::array(), edges = json::array();
  for (const AssistView::Node& node : view.nodes) {
    json shown = degrees(node.direction);
    shown.update({{"name", node.name}, {"face", node.face}, {"sigma_mm", 1e3 * node.sigma_m}});
    nodes.push_back(shown);
  }
  for (const auto& [from, to] : view.edges) edges.push_back({degrees(from), degrees(to)});
  return {{"face", view.face},    {"corner", view.corner},
          {"nodes", nodes},       {"pointing", view.pointing ? degrees(*view.pointing) : json()},
          {"part", view.part},    {"edges", edges},
          {"fitted", view.fitted}};
}

/// Returns why a line is refused; empty if it is not.
std::string refusal_of(const std::string& line) {
  const bool plain = std::ranges::none_of(line, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (plain && line.size() <= kMaxLine) return "";
  return "a line has at most " + std::to_string(kMaxLine) + " octets, none of them a control character";
}

/// The dialogue between the assistant's thread and the page's: one line at a time.
class Dialogue {
 public:
  explicit Dialogue(std::ostream& terminal) : terminal_(terminal) {}

  /// Waits for a line; before that, shows that the assistant is ready for one.
  std::string next_line() {
    std::unique_lock lock(mutex_);
    busy_ = false;
    publish();
    came_.wait(lock, [this] { return line_.has_value(); });
    std::string line = *std::exchange(line_, std::nullopt) + "\n";
    add(line);
    return line;
  }
  /// Gives the assistant a line. Returns false while it carries out an earlier one.
  bool offer(std::string line) {
    const std::lock_guard lock(mutex_);
    if (busy_) return false;
    busy_ = true;
    line_ = std::move(line);
    publish();
    came_.notify_one();
    return true;
  }
  void say(std::string_view words) {
    const std::lock_guard lock(mutex_);
    add(words);
  }
  void show(const AssistView& view) {
    const std::lock_guard lock(mutex_);
    view_ = view_json(view);
  }
  void show_candidates(std::string html) {
    const std::lock_guard lock(mutex_);
    candidates_ = std::move(html);
    ++candidates_number_;
  }
  std::string candidates() const {
    const std::lock_guard lock(mutex_);
    return candidates_;
  }
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    publish();
  }
  web::Broadcast<std::string>& states() { return states_; }

 private:
  void add(std::string_view words) {
    terminal_ << words << std::flush;
    words_ += words;
    if (words_.size() <= kMaxWords) return;
    words_.erase(0, words_.find('\n', words_.size() - kMaxWords) + 1);
  }
  void publish() {
    json state = view_;
    state.update({{"number", ++number_},
                  {"busy", busy_},
                  {"ended", ended_},
                  {"words", words_},
                  {"candidates", candidates_number_}});
    // A terminal's words may be of any encoding: the names of files.
    states_.publish(state.dump(-1, ' ', false, json::error_handler_t::replace));
  }

  std::ostream& terminal_;
  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::optional<std::string> line_;
  bool busy_ = true, ended_ = false;
  std::string words_, candidates_;
  std::uint64_t number_ = 0, candidates_number_ = 0;
  json view_ = view_json({});
  web::Broadcast<std::string> states_;
};

struct LinesBuffer final : std::streambuf {
  explicit LinesBuffer(Dialogue& of) : dialogue(of) {}
  int_type underflow() override {
    line = dialogue.next_line();
    setg(line.data(), line.data(), line.data() + line.size());
    return traits_type::to_int_type(line.front());
  }
  Dialogue& dialogue;
  std::string line;
};

struct WordsBuffer final : std::streambuf {
  explicit WordsBuffer(Dialogue& of) : dialogue(of) {}
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char one = traits_type::to_char_type(c);
    dialogue.say({&one, 1});
    return c;
  }
  std::streamsize xsputn(const char* text, std::streamsize size) override {
    dialogue.say({text, static_cast<std::size_t>(size)});
    return size;
  }
  Dialogue& dialogue;
};

}  // namespace

struct SurveyPage::Impl {
  Impl(int port, std::ostream& terminal) : dialogue(terminal) {
    web::set_common_answers(gate.server(), "the assistant");
    gate.server().set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          return check(request, response);
        });
    add_files();
    add_dialogue();
    gate.bind("127.0.0.1", port, "--serve");
    url = "http://127.0.0.1:" + std::to_string(gate.port()) + "/" + key + "/";
    gate.start();
  }
  ~Impl() {
    dialogue.end();
    gate.stop();
  }

  /// Lets no request pass that does not know the key, names another host, or that a foreign page makes.
  httplib::Server::HandlerResponse check(const httplib::Request& request, httplib::Response& response) const {
    using enum httplib::Server::HandlerResponse;
    const std::string named = request.path.substr(0, std::min(request.path.size(), key.size() + 2));
    if (!runtime::same_secret(named, "/" + key + "/"))
      return web::answer(response, 404, "unknown address: it has a key, which the terminal shows"), Handled;
    if (request.method == "POST") return Unhandled;  // refused by the handler, once the body has been read
    const web::RequestOrigin origin = web::origin_of(request);
    const auto own = origins.host_of(origin).value_or(web::Authority());
    const std::string refused = origins.read_refusal(origin, own, request.path.size() != named.size());
    return refused.empty() ? Unhandled : (web::answer(response, 403, refused), Handled);
  }
  void add_file(const std::string& name, const char* text, const char* type) {
    gate.server().Get(
        "/" + key + "/" + name, [text, type](const httplib::Request&, httplib::Response& response) {
          response.set_header("Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'");
          response.set_content(text, type);
        });
  }
  void add_files() {
    add_file("", kSurveyPage, "text/html; charset=utf-8");
    add_file("survey.js", kSurveyScript, "text/javascript; charset=utf-8");
    add_file("survey.css", kSurveyStyle, "text/css; charset=utf-8");
    add_file("tokens.css", kTokensCss, "text/css; charset=utf-8");
    gate.server().Get(
        "/" + key + "/candidates", [this](const httplib::Request&, httplib::Response& response) {
          const std::string html = dialogue.candidates();
          if (html.empty()) return web::answer(response, 404, "nothing is left to choose among");
          // One file with its script and pictures in it; it reads nothing, and only our page shows it.
          response.set_header(
              "Content-Security-Policy",
              "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src "
              "data:; frame-ancestors 'self'");
          response.set_content(html, "text/html; charset=utf-8");
        });
  }
  void add_dialogue() {
    gate.server().Get("/" + key + "/state",
                      [this](const httplib::Request& request, httplib::Response& response) {
                        std::uint64_t seen = 0;
                        const std::string text = request.get_param_value("seen");
                        std::from_chars(text.data(), text.data() + text.size(), seen);
                        const auto state = dialogue.states().next(seen, kPatience);
                        if (state)
                          response.set_content(*state, "application/json");
                        else
                          response.status = 204;
                      });
    gate.server().Post("/" + key + "/line",
                       [this](const httplib::Request& request, httplib::Response& response) {
                         if (const std::string why = web::command_refusal(origins, request); !why.empty())
                           return web::answer(response, 403, why);
                         const json asked = json::parse(request.body, nullptr, false);
                         if (!asked.is_object() || !asked.contains("line") || !asked["line"].is_string())
                           return web::answer(response, 400, R"(needs {"line": "what a person would type"})");
                         const std::string line = asked["line"].get<std::string>();
                         if (const std::string why = refusal_of(line); !why.empty())
                           return web::answer(response, 400, why);
                         if (!dialogue.offer(line))
                           return web::answer(response, 409, "the line before this one is still carried out");
                         web::answer(response, 200, "");
                       });
  }

  const std::string key = runtime::random_hex(kKeyOctets);
  const web::OriginRule origins{{}, "http"};
  Dialogue dialogue;
  LinesBuffer lines_buffer{dialogue};
  WordsBuffer words_buffer{dialogue};
  std::istream lines{&lines_buffer};
  std::ostream words{&words_buffer};
  std::string url;
  web::RequestGate gate{"survey_page", {.workers = 8}, nullptr};
};

SurveyPage::SurveyPage(int port, std::ostream& terminal) : impl_(std::make_unique<Impl>(port, terminal)) {}
SurveyPage::~SurveyPage() = default;
const std::string& SurveyPage::url() const { return impl_->url; }
std::istream& SurveyPage::lines() { return impl_->lines; }
std::ostream& SurveyPage::words() { return impl_->words; }
void SurveyPage::show(const AssistView& view) { impl_->dialogue.show(view); }
void SurveyPage::show_candidates(std::string html) { impl_->dialogue.show_candidates(std::move(html)); }

}  // namespace phantom::workspace_survey
