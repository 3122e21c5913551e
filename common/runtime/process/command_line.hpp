#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace phantom::runtime {

/// Constrains the values of an option; its calls can be chained after Command::option. It is a handle; the
/// command line owns the option.
class Option {
 public:
  explicit Option(CLI::Option& option) noexcept : option_(&option) {}
  Option& required();
  /// Accepts numbers from `lowest` to `highest` and refuses NaN.
  Option& between(int lowest, int highest);
  Option& between(double lowest, double highest);
  /// Numbers from 0; NaN is refused.
  Option& not_negative();
  Option& one_of(const std::vector<std::string>& allowed);
  /// Accepts texts for which `why_not` returns an empty text; otherwise that is the error.
  Option& accepted_by(std::function<std::string(const std::string&)> why_not);
  /// Lets one argument hold several values, e.g. "4,4,2".
  Option& separated_by(char delimiter);
  /// Lets a list take one value each time it is named, so that a positional argument may follow.
  Option& one_value_each_time();

 private:
  CLI::Option* option_;
};

/// A command of a command line, with its options and subcommands. It is a handle; the command line owns the
/// command. Options of a command may also stand after its subcommand. Bound variables must outlive the
/// parsing; they keep their values if the option is not given. `help` is shown by --help.
class Command {
 public:
  Command() = default;
  explicit Command(CLI::App& app) noexcept : app_(&app) {}

  /// Binds `value` to "--name", or to a positional argument (a name without dashes). T: std::string,
  /// std::filesystem::path, int, unsigned, std::uint64_t, double, std::optional of int or double, or a vector
  /// of std::string, std::filesystem::path, int or double.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help);
  /// Calls `take` with the option's text once the text is valid.
  Option option(const std::string& name, std::function<void(const std::string&)> take,
                const std::string& help);
  void flag(const std::string& name, bool& value, const std::string& help);
  /// Adds a flag that prints `text` and ends the parsing, as --version does.
  void text_flag(const std::string& name, const std::string& text, const std::string& help);
  Command subcommand(const std::string& name, const std::string& summary);
  /// Requires at least `least` and at most `most` of the subcommands.
  void require_subcommand(int least, int most);
  /// Calls `use` after parsing if the command is given.
  void on_use(std::function<void()> use);
  /// Adds text below the options in --help.
  void details(const std::string& text);
  /// Returns whether the command was on the command line; false for a default-constructed handle.
  bool given() const;

 private:
  CLI::App* app_ = nullptr;
};

/// Parses a process's command line. Only this class's source knows the parser (CLI11).
class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& summary, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Command root() noexcept;
  /// Parses the arguments. Returns nothing on success. Otherwise help, version or an error has been printed,
  /// and the returned value says whether it was an error.
  std::optional<bool> parse(int argc, const char* const* argv);
  /// Parses again, with `before` ahead of the same arguments, which win where both give an option one value.
  /// Throws core::ConfigError.
  void parse_after(const std::vector<std::string>& before, int argc, const char* const* argv);
  /// Returns whether the arguments named a subcommand.
  bool has_subcommand() const;
  /// Parses arguments, split as a shell splits them. Throws core::ConfigError.
  void parse(const std::string& arguments);

 private:
  std::unique_ptr<CLI::App> app_;
};

/// Returns the number that the whole of `text` represents, or nothing if it is not a number.
std::optional<double> number_of(const std::string& text);

}  // namespace phantom::runtime
