//! Dates and times of day in text, as exact seconds.

use super::exact::fixed;

/// Seconds since 1970, or since midnight without a date, as a [fixed](super::exact::fixed) number. Forms:
/// `2024-03-05 09:12:40.004`, `2024-03-05T08:12:40Z`, `2024/03/05 …+01:00`, `05.03.2024 09:12:40,004`, `09:12:40.004`.
pub(super) fn seconds(cell: &str) -> Option<i128> {
    let (date, rest) = match cell.split_once(['T', ' ']) {
        Some((date, rest)) => (days(date)?, rest.trim()),
        None => (0, cell),
    };
    let (time, zone) = match rest.find(['Z', '+', '-']) {
        Some(place) => (rest[..place].trim_end(), zone(&rest[place..])?),
        None => (rest, 0),
    };
    let mut parts = time.split(':');
    let (hours, minutes) = (parts.next()?.parse::<u32>().ok()?, parts.next()?.parse::<u32>().ok()?);
    let seconds = parts.next()?.replace(',', ".");
    if parts.next().is_some() || hours > 23 || minutes > 59 || !seconds.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let seconds = fixed(&seconds).filter(|seconds| *seconds < whole(61))?;
    Some(whole(date * 86_400 + i64::from(hours) * 3600 + i64::from(minutes) * 60 - zone) + seconds)
}

fn whole(seconds: i64) -> i128 {
    i128::from(seconds) * fixed("1").unwrap_or(1)
}

/// Seconds of `Z`, `+01:00` or `-0530`.
fn zone(text: &str) -> Option<i64> {
    if text == "Z" {
        return Some(0);
    }
    let digits = text.get(1..)?.replace(':', "");
    let hours: i64 = digits.get(..2)?.parse().ok()?;
    let minutes: i64 = if digits.len() == 4 { digits.get(2..)?.parse().ok()? } else { 0 };
    let seconds = hours * 3600 + minutes * 60;
    (digits.len() == 2 || digits.len() == 4).then_some(if text.starts_with('-') { -seconds } else { seconds })
}

/// Days from 1970-01-01 to a date of the civil calendar: year first, or with points day first.
fn days(date: &str) -> Option<i64> {
    let numbers: Option<Vec<i64>> = date.split(['-', '/', '.']).map(|part| part.parse().ok()).collect();
    let [a, month, b] = numbers?[..] else { return None };
    let (year, day) = if date.contains('.') { (b, a) } else { (a, b) };
    if !(1600..=9999).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Years begin in March, so that the leap day is the last one.
    let (year, month) = if month <= 2 { (year - 1, month + 9) } else { (year, month - 3) };
    let day_of_year = (153 * month + 2) / 5 + day - 1;
    Some(365 * year + year / 4 - year / 100 + year / 400 + day_of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::super::exact::value;
    use super::*;

    #[test]
    fn dates_of_several_forms_are_the_same_seconds() {
        for cell in [
            "2024-03-05 09:12:40.004",
            "2024-03-05T09:12:40.004Z",
            "2024-03-05 10:12:40.004+01:00",
            "2024/03/05 03:42:40,004-0530",
            "05.03.2024 09:12:40,004",
        ] {
            let seconds = seconds(cell).unwrap_or_else(|| panic!("{cell}"));
            assert_eq!(value(seconds), 1_709_629_960.004, "{cell}");
        }
        assert_eq!(seconds("09:12:40.25").map(value), Some(33_160.25));
        for cell in
            ["", "1.5", "2024-03-05", "09:12", "25:00:00", "1:2:3:4", "a:b:c", "2024-13-05 00:00:00", "05.03.24 1:1:1"]
        {
            assert_eq!(seconds(cell), None, "{cell}");
        }
    }
}
