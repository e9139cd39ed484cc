/* The fast ones among the cases of the program `stability`, in both forms, each with its acceptance */
#include "support.h"
#include <hhtdae/scene.h>

#include "../bench/stability_all.h"

#include <cctype>

using namespace hhtstab;

namespace
{

Cases quickCases()
{
  Cases quick;
  for (const Case &c : AllCases())
    if (c.quick) quick.push_back(c);
  return quick;
}

class Extreme : public testing::TestWithParam<std::tuple<Case, TSHHT3Form>>
{
};

std::string testName(const testing::TestParamInfo<Extreme::ParamType> &info)
{
  std::string s =
      std::get<0>(info.param).kind + "_" + std::get<0>(info.param).name + "_" + TSHHT3Forms[std::get<1>(info.param)];
  for (char &c : s)
    if (!std::isalnum((unsigned char)c)) c = c == '-' ? 'm' : '_';
  return s;
}

} // namespace

TEST_P(Extreme, KeepsItsAcceptanceFigure)
{
  const Case      &c    = std::get<0>(GetParam());
  const TSHHT3Form form = std::get<1>(GetParam());
  Outcome          out;
  RunCase(c, form, out);
  MEASURED("%s: %.2e, allowed %.2e; %d steps, %d failed corrections; %s", c.measure.c_str(), out.figure,
           c.acceptance(form), (int)out.s.steps, (int)out.s.corrector_fails, out.message[0] ? out.message : out.note);
  EXPECT_TRUE(c.passed(form, out)) << c.kind << ", " << c.name << ": figure " << out.figure << " of "
                                   << c.acceptance(form) << ", " << (out.message[0] ? out.message : "no error")
                                   << (c.message.empty() ? "" : ", expected: ") << c.message;
}

INSTANTIATE_TEST_SUITE_P(Cases, Extreme,
                         testing::Combine(testing::ValuesIn(quickCases()),
                                          testing::Values(TSHHT3_FORM_SECOND_ORDER, TSHHT3_FORM_PAPER)),
                         testName);
