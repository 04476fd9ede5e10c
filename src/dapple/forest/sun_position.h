// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::forest {

/// Where and when, in Universal Time. Degrees, north and east positive.
struct PlaceAndTime {
  double latitude_deg = 0, longitude_deg = 0;
  int year = 2000, month = 1, day = 1;
  double hour = 12;  ///< UT, may leave [0, 24)
};

struct SunPosition {
  double zenith_deg = 0;
  double compass_deg = 0;  ///< clockwise from north: 90 is east
};

/// The sun's place in the sky by the Astronomical Almanac's low-precision formulas (Michalsky 1988): within .01 degree
/// from 1950 to 2050. Without refraction, which lifts it by .02 degree at 40 degrees of zenith angle, .1 at 80 and .6
/// at the horizon.
SunPosition sun_position(const PlaceAndTime& at);

/// Days of a month; 0 if there is no such month.
int days_of_month(int year, int month);

}  // namespace dapple::forest
