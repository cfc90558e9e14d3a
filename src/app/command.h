#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): as CLI11 has it
class App;
class Option;
}  // namespace CLI

namespace sovo::app {

// The command line, with CLI11 behind it. Only command.cpp sees CLI11: it takes the compiler ten
// seconds a file.

/// An option of a command.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option* option) : option_(option) {}

  CommandOption& required();
  /// What `--help` shows for the value.
  CommandOption& type(const std::string& name);
  CommandOption& positive();
  CommandOption& in_range(int least, int most);
  CommandOption& one_of(const std::vector<std::string>& values);
  CommandOption& comma_separated();
  /// `--help` shows the value that the variable has now.
  CommandOption& show_default();
  CommandOption& show_default(const std::string& text);
  /// May be given several times, a value each.
  CommandOption& repeatable();

  /// How often the user named it, and with which values.
  std::size_t count() const;
  const std::vector<std::string>& values() const;

 private:
  CLI::Option* option_;
};

/// A command or subcommand. Copies stand for the same command; they live as long as the program.
class Command {
 public:
  Command(CLI::App* app, int* exit_code) : app_(app), exit_code_(exit_code) {}

  Command add_command(const std::string& name, const std::string& help) const;
  /// One of the subcommands must be named.
  void require_command() const;
  /// Text at the end of `--help`.
  void footer(const std::string& text) const;

  // `value` must outlive the parsing; it holds the default before and the user's value after.
  CommandOption option(const std::string& name, const std::string& help, std::string* value) const;
  CommandOption option(const std::string& name, const std::string& help, int* value) const;
  CommandOption option(const std::string& name, const std::string& help, std::size_t* value) const;
  CommandOption option(const std::string& name, const std::string& help, double* value) const;
  CommandOption option(const std::string& name, const std::string& help,
                       std::vector<double>* value) const;
  CommandOption flag(const std::string& name, const std::string& help, bool* value) const;
  /// With one value that `CommandOption::values` has after parsing.
  CommandOption option(const std::string& name, const std::string& help) const;
  CommandOption flag(const std::string& name, const std::string& help) const;
  /// `use` is called with the value while parsing.
  CommandOption option(const std::string& name, const std::string& help,
                       const std::function<void(const std::string&)>& use) const;

  /// An option of the program itself.
  CommandOption global_option(const std::string& name) const;

  /// What the command does, after parsing; gives the program's exit code.
  void action(std::function<int()> work) const;

 private:
  CLI::App* app_;
  int* exit_code_;
};

/// The program: options of its own, and commands.
class Program {
 public:
  Program(const std::string& name, const std::string& help, const std::string& version);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  Command root();
  /// Parses and works; the exit code. Help and complaints are printed.
  int run(int argc, char** argv);

 private:
  std::unique_ptr<CLI::App> app_;
  int exit_code_ = 0;
};

}  // namespace sovo::app
