// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_lights.h"

#include "dapple/modelfile/param_list.h"

namespace dapple::modelfile {

using scenefile::ParamType;

namespace {

// Of what has no unit: the colour, at most 1.
RGB bounded(const RGB& c) {
  return c.max() > 1 ? c / c.max() : c;
}

void add_intensity(const ModelLight& l, const V3d& middle, Directive* d) {
  if (l.physical) {
    d->rgb("I", l.color / lumens_a_watt);
    return;
  }
  const double distance2 = (l.position - middle).length2();
  d->rgb("I", bounded(l.color) * (pi * float(distance2 > 0 ? distance2 : 1)));
}

void emit_area(const ModelLight& l, const FileLoc& loc, scenefile::DescriptionBuilder* builder) {
  const V3d z = l.direction.normalized();
  V3d x = l.up.cross(z);
  x = x.length() > 1e-6 ? x.normalized() : (std::abs(z.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0)).cross(z).normalized();
  const V3d y = z.cross(x), right = x * double(l.width) / 2, up = y * double(l.height) / 2;
  std::vector<float> corners;
  // In the order of bilinear patches; the normal is the cross product of its sides u and v, which is z.
  for (const V3d& p :
       {l.position - right - up, l.position + right - up, l.position - right + up, l.position + right + up})
    for (int k = 0; k < 3; ++k) corners.push_back(float(p[k]));
  builder->attribute_begin(loc);
  Directive light("diffuse", loc), shape("bilinearmesh", loc);
  light.rgb("L", bounded(l.color) * 10);
  builder->area_light(light.take());
  shape.floats("P", ParamType::point3, std::move(corners));
  builder->shape(shape.take());
  builder->attribute_end(loc);
}

}  // namespace

size_t emit_lights(const Model& model, const FileLoc& loc, scenefile::DescriptionBuilder* builder) {
  const Imath::Box3d box = bounds_of(model);
  const V3d middle = box.isEmpty() ? V3d(0, 0, 0) : box.center();
  for (const ModelLight& l : model.lights) {
    switch (l.type) {
      case ModelLight::point: {
        Directive d("point", loc);
        d.point("from", l.position);
        add_intensity(l, middle, &d);
        builder->light(d.take());
        break;
      }
      case ModelLight::spot: {
        Directive d("spot", loc);
        const double outer = std::clamp(double(l.cone_outer), 0.5, 89.9);
        d.point("from", l.position).point("to", l.position + l.direction).number("coneangle", outer);
        d.number("conedeltaangle", std::clamp(outer - double(l.cone_inner), 0.01, outer));
        add_intensity(l, middle, &d);
        builder->light(d.take());
        break;
      }
      case ModelLight::distant: {
        Directive d("distant", loc);
        d.point("from", V3d(0, 0, 0)).point("to", l.direction);
        d.rgb("L", l.physical ? l.color / lumens_a_watt : bounded(l.color) * pi);
        builder->light(d.take());
        break;
      }
      case ModelLight::ambient: {
        Directive d("infinite", loc);
        d.rgb("L", bounded(l.color));
        builder->light(d.take());
        break;
      }
      case ModelLight::area:
        if (l.width > 0 && l.height > 0) emit_area(l, loc, builder);
        break;
    }
  }
  return model.lights.size();
}

}  // namespace dapple::modelfile
