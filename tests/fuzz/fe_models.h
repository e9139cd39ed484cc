/* Shared by the readers of finite-element models: whether an accepted model is possible */
#ifndef HHTDAE_TESTS_FUZZ_FE_MODELS_H
#define HHTDAE_TESTS_FUZZ_FE_MODELS_H

#include "fuzz.h"
#include "hhtdae/flexible.h"

namespace hhtfuzz
{

/* "" if nothing is wrong */
std::string Nonsense(const hhtdae::FeModel &model);

} // namespace hhtfuzz

#endif
