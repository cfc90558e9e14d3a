#include "sovo/app/command.h"

#include <CLI/CLI.hpp>
#include <utility>

#include "sovo/app/exit_codes.h"

namespace sovo::app {

CommandOption& CommandOption::required() {
  option_->required();
  return *this;
}

CommandOption& CommandOption::type(const std::string& name) {
  option_->type_name(name);
  return *this;
}

CommandOption& CommandOption::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

CommandOption& CommandOption::in_range(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}

CommandOption& CommandOption::one_of(const std::vector<std::string>& values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

CommandOption& CommandOption::comma_separated() {
  option_->delimiter(',');
  return *this;
}

CommandOption& CommandOption::show_default() {
  option_->capture_default_str();
  return *this;
}

CommandOption& CommandOption::show_default(const std::string& text) {
  option_->default_str(text);
  return *this;
}

CommandOption& CommandOption::repeatable() {
  option_->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)->take_all();
  return *this;
}

std::size_t CommandOption::count() const { return option_->count(); }

const std::vector<std::string>& CommandOption::values() const { return option_->results(); }

Command Command::add_command(const std::string& name, const std::string& help) const {
  return {app_->add_subcommand(name, help), exit_code_};
}

void Command::require_command() const { app_->require_subcommand(1); }

void Command::footer(const std::string& text) const { app_->footer(text); }

CommandOption Command::option(const std::string& name, const std::string& help,
                              std::string* value) const {
  return CommandOption(app_->add_option(name, *value, help));
}

CommandOption Command::option(const std::string& name, const std::string& help, int* value) const {
  return CommandOption(app_->add_option(name, *value, help));
}

CommandOption Command::option(const std::string& name, const std::string& help,
                              std::size_t* value) const {
  return CommandOption(app_->add_option(name, *value, help));
}

CommandOption Command::option(const std::string& name, const std::string& help,
                              double* value) const {
  return CommandOption(app_->add_option(name, *value, help));
}

CommandOption Command::option(const std::string& name, const std::string& help,
                              std::vector<double>* value) const {
  return CommandOption(app_->add_option(name, *value, help));
}

CommandOption Command::flag(const std::string& name, const std::string& help, bool* value) const {
  return CommandOption(app_->add_flag(name, *value, help));
}

CommandOption Command::option(const std::string& name, const std::string& help) const {
  return CommandOption(app_->add_option(name, help)->expected(1));
}

CommandOption Command::flag(const std::string& name, const std::string& help) const {
  return CommandOption(app_->add_flag(name, help));
}

CommandOption Command::option(const std::string& name, const std::string& help,
                              const std::function<void(const std::string&)>& use) const {
  return CommandOption(app_->add_option_function<std::string>(name, use, help));
}

CommandOption Command::global_option(const std::string& name) const {
  CLI::App* app = app_;
  while (app->get_parent() != nullptr) app = app->get_parent();
  return CommandOption(app->get_option(name));
}

void Command::action(std::function<int()> work) const {
  app_->callback([code = exit_code_, work = std::move(work)] { *code = work(); });
}

Program::Program(const std::string& name, const std::string& help, const std::string& version)
    : app_(std::make_unique<CLI::App>(help)) {
  app_->name(name);
  app_->set_version_flag("--version", name + " " + version);
  app_->require_subcommand(1);
  app_->fallthrough();
}

Program::~Program() = default;

Command Program::root() { return {app_.get(), &exit_code_}; }

int Program::run(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? kOk : kUsage;
  }
  return exit_code_;
}

}  // namespace sovo::app
