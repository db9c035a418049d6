// SPDX-License-Identifier: Apache-2.0
#include "renderer/io/channel_names.h"

#include <gmock/gmock.h>

namespace scolopax::io {
namespace {

using testing::ElementsAre;

TEST(ShortNames, DropTheWordsThatAllNamesHaveInCommon) {
  EXPECT_THAT(shortNames({"TCGA-DU-7294_t1_bet", "TCGA-DU-7294_t1c_bet", "TCGA-DU-7294_fla_bet"}),
              ElementsAre("t1", "t1c", "fla"));
  EXPECT_THAT(shortNames({"data/1/meshes/B/x", "data/1/meshes/B/y", "data/1/meshes/B/z"}),
              ElementsAre("x", "y", "z"));
  EXPECT_THAT(shortNames({"a red", "a green"}), ElementsAre("red", "green"));
}

TEST(ShortNames, KeepWholeWords) {
  EXPECT_THAT(shortNames({"pressure", "prandtl"}), ElementsAre("pressure", "prandtl"));
  EXPECT_THAT(shortNames({"brain_t1", "brain_t2"}), ElementsAre("t1", "t2"));
  EXPECT_THAT(shortNames({"x_bet", "y_set"}), ElementsAre("x_bet", "y_set"));
}

TEST(ShortNames, KeepAWordWithALetter) {
  EXPECT_THAT(shortNames({"run_1_step_10", "run_1_step_25"}), ElementsAre("step_10", "step_25"));
  EXPECT_THAT(shortNames({"a 0", "a 1"}), ElementsAre("a 0", "a 1"));
  EXPECT_THAT(shortNames({"t1", "t1_bet"}), ElementsAre("t1", "t1_bet"));
  EXPECT_THAT(shortNames({"m_\xCF\x88", "m_\xCF\x81"}), ElementsAre("\xCF\x88", "\xCF\x81"));
}

TEST(ShortNames, LeaveASingleNameAndEqualNamesAlone) {
  EXPECT_THAT(shortNames({}), ElementsAre());
  EXPECT_THAT(shortNames({"brain_t1"}), ElementsAre("brain_t1"));
  EXPECT_THAT(shortNames({"a_b", "a_b"}), ElementsAre("a_b", "a_b"));
  EXPECT_THAT(shortNames({"x_density", "x_density", "x_speed"}), ElementsAre("density", "density", "speed"));
}

}  // namespace
}  // namespace scolopax::io
