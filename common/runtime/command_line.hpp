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

/// What an option may be given, as a chain behind Command::option. A handle; the command line owns the
/// option.
class Option {
 public:
  explicit Option(CLI::Option& option) noexcept : option_(&option) {}
  Option& required();
  /// Numbers from `lowest` to `highest`; NaN is refused.
  Option& between(int lowest, int highest);
  Option& between(double lowest, double highest);
  Option& one_of(const std::vector<std::string>& allowed);
  /// One argument may hold several values, e.g. "4,4,2".
  Option& separated_by(char delimiter);
  /// A list takes one value each time that it is named: what follows may be a positional argument.
  Option& one_value_each_time();

 private:
  CLI::Option* option_;
};

/// A command of a command line, with its options and subcommands. A handle; the command line owns the
/// command. Options of a command may also stand behind its subcommand. Variables that are bound must outlive
/// the parsing; they keep their values where the option is not given. `help` is shown by --help.
class Command {
 public:
  Command() = default;
  explicit Command(CLI::App& app) noexcept : app_(&app) {}

  /// Binds `value` to "--name", or to a positional argument (a name without dashes). T: std::string,
  /// std::filesystem::path, int, unsigned, std::uint64_t, double, std::optional<double>, or a vector of
  /// std::string, std::filesystem::path, int or double.
  template <class T>
  Option option(const std::string& name, T& value, const std::string& help);
  /// The same with a function that gets the text once it is valid.
  Option option(const std::string& name, std::function<void(const std::string&)> take,
                const std::string& help);
  void flag(const std::string& name, bool& value, const std::string& help);
  /// A flag that prints `text` and ends the parsing, as --version does.
  void text_flag(const std::string& name, const std::string& text, const std::string& help);
  Command subcommand(const std::string& name, const std::string& summary);
  /// At least `least` and at most `most` of the subcommands must be given.
  void require_subcommand(int least, int most);
  /// Called after parsing if the command is given.
  void on_use(std::function<void()> use);
  /// Text below the options in --help.
  void details(const std::string& text);
  /// Whether the command stood on the command line; false for a default-constructed handle.
  bool given() const;

 private:
  CLI::App* app_ = nullptr;
};

/// A process's command line. The only place, with its source, that knows the parser (CLI11).
class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& summary, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Command root() noexcept;
  /// Nothing if all is well. Otherwise help, version or an error has been printed, and whether it was an
  /// error.
  std::optional<bool> parse(int argc, const char* const* argv);
  /// Parses arguments as a shell would split them. Throws core::ConfigError.
  void parse(const std::string& arguments);

 private:
  std::unique_ptr<CLI::App> app_;
};

/// `text` as a number, whole; nothing if it is not one.
std::optional<double> number_of(const std::string& text);

}  // namespace phantom::runtime
