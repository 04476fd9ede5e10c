// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

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
  /// From +x towards +y, where these are east and north.
  double azimuth_deg() const { return 90 - compass_deg; }
};

/// The sun's place in the sky by the Astronomical Almanac's low-precision formulas (Michalsky 1988): within .01 degree
/// from 1950 to 2050. Without refraction, which lifts it by .02 degree at 40 degrees of zenith angle, .1 at 80 and .6
/// at the horizon.
SunPosition sun_position(const PlaceAndTime& at);

struct SunOfHour {
  double hour;  ///< UT
  SunPosition sun;
};
/// The sun's way over part of a day: `count` places, evenly in time, the first at `from_hour`, the last, if there are
/// several, at `to_hour`. at.hour is not read.
std::vector<SunOfHour> sun_course(PlaceAndTime at, double from_hour, double to_hour, int count);

/// Whether there is such a day, and sun_position() knows it: from 1950 to 2050.
bool is_known_day(int year, int month, int day);

/// Days of a month; 0 if there is no such month.
int days_of_month(int year, int month);

}  // namespace dapple::forest
