// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/openpbr_material.h"

#include <gtest/gtest.h>

#include "dapple/scattering/principled.h"

namespace dapple::shading {
namespace {

TEST(OpenPbr, DefaultsSayWhatTheyAre) {
  const OpenPbrMaterial m({}, {});
  EXPECT_FALSE(m.is_diffuse());
  EXPECT_TRUE(m.is_diffuse_to_rays());
  EXPECT_TRUE(m.is_opaque_reflector());
  ASSERT_TRUE(m.constant());
  const scattering::PrincipledLayers p(*m.constant());
  EXPECT_FLOAT_EQ(p.alpha_x, 0.09f);
  EXPECT_FLOAT_EQ(p.ior, 1.5f);
  OpenPbrInputs in;
  in.specular_weight = pattern::Input<float>(0.0f);
  const OpenPbrMaterial flat(in, {});
  EXPECT_TRUE(flat.is_diffuse());
  EXPECT_EQ(flat.constant()->kind, scattering::BsdfKind::diffuse);
  in.base_metalness = pattern::Input<float>(0.5f);
  EXPECT_FALSE(OpenPbrMaterial(in, {}).is_diffuse_to_rays());
  in.transmission_weight = pattern::Input<float>(0.5f);
  EXPECT_FALSE(OpenPbrMaterial(in, {}).is_opaque_reflector());
}

}  // namespace
}  // namespace dapple::shading
