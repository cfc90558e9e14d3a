#include "sovo/io/yaml_config.h"

#include <gtest/gtest.h>

#include <random>

#include "io/io_test_support.h"

namespace sovo {
namespace {

enum class Colour { kRed, kGreen };
constexpr std::array<std::pair<Colour, const char*>, 2> enum_names(Colour) {
  return {{{Colour::kRed, "red"}, {Colour::kGreen, "green"}}};
}

struct Inner {
  int points = 2000;
  double huber = 9.0;
  template <class Visitor>
  void visit(Visitor& v) {
    v("points", points, "active points");
    v("huber", huber, "threshold [grey levels]");
  }
};

struct Outer {
  bool on = false;
  std::string name = "a";
  Colour colour = Colour::kRed;
  std::vector<double> rates = {1.5, 2.0};
  std::vector<std::string> names;
  float small = 0.1F;
  std::uint64_t seed = 7;
  Inner vo;
  template <class Visitor>
  void visit(Visitor& v) {
    v("on", on, "switch");
    v("name", name, "a name");
    v("colour", colour, "a colour");
    v("rates", rates, "rates [Hz]");
    v("names", names, "more names");
    v("small", small, "a small number");
    v("seed", seed, "seed");
    v("vo", vo, "odometry");
  }
};

std::string error_of(const std::string& yaml) {
  Outer config;
  const auto result = load_config_text(yaml, "f.yaml", &config);
  return result ? "" : result.error();
}

TEST(YamlConfig, SetsWhatIsNamedAndKeepsTheRest) {
  Outer config;
  const auto result = load_config_text(
      "on: true\ncolour: green\nrates: [3, 4e-1]\nvo:\n  points: 800\nname: \"x: y\"\n", "f.yaml",
      &config);
  ASSERT_TRUE(result) << result.error();
  EXPECT_TRUE(config.on);
  EXPECT_EQ(config.colour, Colour::kGreen);
  EXPECT_EQ(config.rates, (std::vector<double>{3.0, 0.4}));
  EXPECT_EQ(config.vo.points, 800);
  EXPECT_EQ(config.vo.huber, 9.0);
  EXPECT_EQ(config.name, "x: y");
}

TEST(YamlConfig, EmptyFileAndEmptySectionsAreDefaults) {
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of("# nothing\n"), "");
  EXPECT_EQ(error_of("vo:\n  # points: 5\n"), "");
}

TEST(YamlConfig, RefusesUnknownKeysByNameLineAndSuggestion) {
  const std::string error = error_of("on: true\nvo:\n  pionts: 3\n");
  EXPECT_TRUE(contains(error, "f.yaml:3: ")) << error;
  EXPECT_TRUE(contains(error, "'pionts'")) << error;
  EXPECT_TRUE(contains(error, "did you mean 'points'")) << error;
  EXPECT_TRUE(contains(error_of("huber: 3\n"), "did you mean 'vo.huber'"));
  EXPECT_TRUE(contains(error_of("xyzzyxyzzy: 3\n"), "known here: on, name"));
}

TEST(YamlConfig, RefusesRepeatedKeys) {
  const std::string error = error_of("vo:\n  points: 3\n  points: 4\n");
  EXPECT_TRUE(contains(error, "f.yaml:3: 'vo.points' is given twice")) << error;
}

TEST(YamlConfig, RefusesWrongTypesWithTheirLine) {
  EXPECT_TRUE(contains(error_of("vo:\n  points: 1.5\n"), "f.yaml:2: 'vo.points' must be a whole"));
  EXPECT_TRUE(contains(error_of("vo:\n  huber: nan\n"), "must be a number, not 'nan'"));
  EXPECT_TRUE(contains(error_of("vo:\n  huber: .inf\n"), "must be a number"));
  EXPECT_TRUE(contains(error_of("vo:\n  huber: '3'\n"), "must be a number"));
  EXPECT_TRUE(contains(error_of("vo:\n  huber:\n"), "must be a number"));
  EXPECT_TRUE(contains(error_of("vo:\n  points: 99999999999\n"), "must be a whole number"));
  EXPECT_TRUE(contains(error_of("on: 1\n"), "must be true or false"));
  EXPECT_TRUE(contains(error_of("seed: -1\n"), "not negative"));
  EXPECT_TRUE(contains(error_of("small: 1e300\n"), "must be a number"));
  EXPECT_TRUE(contains(error_of("rates: 3\n"), "must be a list of numbers"));
  EXPECT_TRUE(contains(error_of("rates: [1, x]\n"), "must be a list of numbers"));
  EXPECT_TRUE(contains(error_of("colour: gren\n"), "one of red|green, not 'gren'; did you mean"));
  EXPECT_TRUE(contains(error_of("vo: 3\n"), "'vo' is a section"));
  EXPECT_TRUE(contains(error_of("- 3\n"), "'key: value'"));
}

TEST(YamlConfig, NamesEveryProblemAtOnceAndChangesNothing) {
  Outer config;
  const auto result = load_config_text("on: true\nnam: x\nsmall: y\n", "f.yaml", &config);
  ASSERT_FALSE(result);
  EXPECT_TRUE(contains(result.error(), "f.yaml:2: "));
  EXPECT_TRUE(contains(result.error(), "f.yaml:3: "));
  EXPECT_FALSE(config.on);
}

TEST(YamlConfig, BrokenYamlIsNamedWithItsLine) {
  EXPECT_TRUE(contains(error_of("on: true\nvo: [1, \n"), "f.yaml:")) << error_of("a: [1, \n");
  EXPECT_TRUE(contains(error_of("on: true\n---\non: false\n"), "more than one"));
  Outer config;
  EXPECT_TRUE(contains(load_config("/no/such/file.yaml", &config).error(), "/no/such/file.yaml"));
}

TEST(YamlConfig, OverridesOneField) {
  Outer config;
  EXPECT_TRUE(apply_override(&config, "vo.points=800"));
  EXPECT_TRUE(apply_override(&config, "name=a = b: [c"));
  EXPECT_TRUE(apply_override(&config, "rates=1,2.5"));
  EXPECT_TRUE(apply_override(&config, "names=[x, y]"));
  EXPECT_TRUE(apply_override(&config, "colour=green"));
  EXPECT_EQ(config.vo.points, 800);
  EXPECT_EQ(config.name, "a = b: [c");
  EXPECT_EQ(config.rates, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(config.names, (std::vector<std::string>{"x", "y"}));
  EXPECT_EQ(config.colour, Colour::kGreen);
  EXPECT_TRUE(contains(apply_override(&config, "vo.pints=1").error(), "did you mean 'points'"));
  EXPECT_TRUE(contains(apply_override(&config, "v.points=1").error(), "did you mean 'vo.points'"));
  EXPECT_TRUE(contains(apply_override(&config, "points=1").error(), "'vo.points'"));
  EXPECT_TRUE(contains(apply_override(&config, "vo=1").error(), "is a section"));
  EXPECT_TRUE(contains(apply_override(&config, "vo.points").error(), "key=value"));
  EXPECT_TRUE(contains(apply_override(&config, "vo.points=x").error(), "whole number"));
  EXPECT_FALSE(apply_override(&config, "=1"));
}

TEST(YamlConfig, DumpReadsBackTheSame) {
  Outer config;
  config.name = "quote \" backslash \\ tab \t";
  config.names = {"a, b", "", "true"};
  config.rates = {1.0 / 3.0, 1e-300, -0.0};
  config.small = 0.3F;
  config.colour = Colour::kGreen;
  config.vo.huber = 1e22;
  const std::string yaml = dump_config(config);
  Outer loaded;
  const auto result = load_config_text(yaml, "dump", &loaded);
  ASSERT_TRUE(result) << result.error() << "\n" << yaml;
  EXPECT_EQ(dump_config(loaded), yaml);
  EXPECT_EQ(loaded.name, config.name);
  EXPECT_EQ(loaded.rates, config.rates);
  EXPECT_EQ(loaded.small, config.small);
  EXPECT_TRUE(contains(yaml, "  points: 2000  # active points\n")) << yaml;
  EXPECT_TRUE(contains(yaml, "(one of red|green)")) << yaml;
}

TEST(YamlConfig, SurvivesTruncatedAndRandomText) {
  const std::string yaml = dump_config(Outer{});
  for (std::size_t n = 0; n < yaml.size(); ++n) {
    Outer config;
    (void)load_config_text(yaml.substr(0, n), "cut", &config);
  }
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    std::string text = yaml;
    for (int k = 0; k < 5; ++k) text[random() % text.size()] = static_cast<char>(random() % 256);
    Outer config;
    const auto result = load_config_text(text, "noise", &config);
    EXPECT_NE(result.ok(), !result.error().empty());
  }
}

}  // namespace
}  // namespace sovo
