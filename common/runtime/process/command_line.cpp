#include "common/runtime/process/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/core/errors.hpp"

namespace phantom::runtime {
namespace {

/// Refuses NaN, which CLI11's ranges accept.
CLI::Validator not_nan() {
  return {[](const std::string& text) {
            double value = 0.0;
            const bool nan = CLI::detail::lexical_cast(text, value) && std::isnan(value);
            return nan ? "is not a finite number" : std::string();
          },
          ""};
}

}  // namespace

Option& Option::required() {
  option_->required();
  return *this;
}
Option& Option::between(int lowest, int highest) {
  option_->check(CLI::Range(lowest, highest));
  return *this;
}
Option& Option::between(double lowest, double highest) {
  option_->check(CLI::Range(lowest, highest))->check(not_nan());
  return *this;
}
Option& Option::not_negative() {
  option_->check(CLI::NonNegativeNumber)->check(not_nan());
  return *this;
}
Option& Option::one_of(const std::vector<std::string>& allowed) {
  option_->check(CLI::IsMember(allowed));
  return *this;
}
Option& Option::accepted_by(std::function<std::string(const std::string&)> why_not) {
  option_->check(std::move(why_not), "");
  return *this;
}
Option& Option::separated_by(char delimiter) {
  option_->delimiter(delimiter);
  return *this;
}
Option& Option::one_value_each_time() {
  option_->take_all()->allow_extra_args(false);
  return *this;
}

template <class T>
Option Command::option(const std::string& name, T& value, const std::string& help) {
  return Option(*app_->add_option(name, value, help));
}
template Option Command::option(const std::string&, std::string&, const std::string&);
template Option Command::option(const std::string&, std::filesystem::path&, const std::string&);
template Option Command::option(const std::string&, int&, const std::string&);
template Option Command::option(const std::string&, unsigned&, const std::string&);
template Option Command::option(const std::string&, std::uint64_t&, const std::string&);
template Option Command::option(const std::string&, double&, const std::string&);
template Option Command::option(const std::string&, std::optional<double>&, const std::string&);
template Option Command::option(const std::string&, std::optional<int>&, const std::string&);
template Option Command::option(const std::string&, std::vector<std::string>&, const std::string&);
template Option Command::option(const std::string&, std::vector<std::filesystem::path>&, const std::string&);
template Option Command::option(const std::string&, std::vector<int>&, const std::string&);
template Option Command::option(const std::string&, std::vector<double>&, const std::string&);

Option Command::option(const std::string& name, std::function<void(const std::string&)> take,
                       const std::string& help) {
  return Option(*app_->add_option_function<std::string>(name, std::move(take), help));
}
void Command::flag(const std::string& name, bool& value, const std::string& help) {
  app_->add_flag(name, value, help);
}
void Command::text_flag(const std::string& name, const std::string& text, const std::string& help) {
  app_->add_flag_callback(
      name, [text] { throw CLI::CallForVersion(text, 0); }, help);
}
Command Command::subcommand(const std::string& name, const std::string& summary) {
  return Command(*app_->add_subcommand(name, summary)->fallthrough());
}
void Command::require_subcommand(int least, int most) {
  app_->require_subcommand(static_cast<std::size_t>(least), static_cast<std::size_t>(most));
}
void Command::on_use(std::function<void()> use) { app_->callback(std::move(use)); }
void Command::details(const std::string& text) { app_->footer(text); }
bool Command::given() const { return app_ != nullptr && app_->parsed(); }

CommandLine::CommandLine(const std::string& name, const std::string& summary, const std::string& version)
    : app_(std::make_unique<CLI::App>(summary, name)) {
  app_->set_version_flag("--version", version);
}
CommandLine::~CommandLine() = default;

Command CommandLine::root() noexcept { return Command(*app_); }

std::optional<bool> CommandLine::parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& problem) {
    return app_->exit(problem) != 0;
  }
}

void CommandLine::parse_after(const std::vector<std::string>& before, int argc, const char* const* argv) {
  for (CLI::Option* option : app_->get_options()) {
    if (option->get_expected_max() == 1) option->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }
  // CLI11 takes them from the end.
  std::vector<std::string> all(argv + 1, argv + argc);
  all.insert(all.begin(), before.begin(), before.end());
  std::reverse(all.begin(), all.end());
  try {
    app_->parse(std::move(all));
  } catch (const CLI::ParseError& problem) {
    throw core::ConfigError(problem.what());
  }
}

bool CommandLine::has_subcommand() const { return !app_->get_subcommands().empty(); }

void CommandLine::parse(const std::string& arguments) {
  try {
    app_->parse(arguments);
  } catch (const CLI::ParseError& problem) {
    throw core::ConfigError(problem.what());
  }
}

std::optional<double> number_of(const std::string& text) {
  double value = 0.0;
  return CLI::detail::lexical_cast(text, value) ? std::optional(value) : std::nullopt;
}

}  // namespace phantom::runtime
