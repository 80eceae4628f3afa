//! A sentence with values in it, as a pattern: told from its finished text, and written again in another language.
//!
//! The template is the format string of the source, `only {own} of {} points`: what stands in a text where a placeholder stands in the
//! template is captured. The translation names the placeholders: by name, or by their number among those without one from 0. It says what
//! a value is where its format does not: `{own:n}` a number, `{why:t}` words of the library, `{why:k}` words that must be known for the
//! whole to be one of its sentences, `{x:p}` a number of a plan's text, which keeps its point; else a name or path, which stays as it is.

/// What a placeholder holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number: written as the language does.
    Number,
    /// Words of the library: translated as well where they are known.
    Words,
    /// Words of the library without which the text is another one.
    Known,
    /// A name, path or word of somebody else: as it is.
    Name,
}

/// A piece of a translation.
#[derive(Debug)]
enum Piece {
    Text(String),
    /// The capture at this place among those of the template.
    Value(usize),
}

/// A template with its translation.
#[derive(Debug)]
pub(super) struct Pattern {
    /// The text before each placeholder, and after the last one.
    literals: Vec<String>,
    kinds: Vec<Kind>,
    pieces: Vec<Piece>,
}

/// A template or translation taken apart: its literals, and between them what stands in the braces.
pub(super) fn taken_apart(template: &str) -> (Vec<String>, Vec<String>) {
    let (mut literals, mut braces) = (vec![String::new()], Vec::new());
    let mut rest = template;
    while let Some(at) = rest.find(['{', '}']) {
        let last = literals.len() - 1;
        literals[last].push_str(&rest[..at]);
        let brace = &rest[at..at + 1];
        rest = &rest[at + 1..];
        match rest.split_once('}') {
            _ if rest.starts_with(brace) => {
                literals[last].push_str(brace);
                rest = &rest[1..];
            }
            Some((inside, after)) if brace == "{" => {
                braces.push(inside.to_owned());
                literals.push(String::new());
                rest = after;
            }
            _ => literals[last].push_str(brace),
        }
    }
    let last = literals.len() - 1;
    literals[last].push_str(rest);
    (literals, braces)
}

/// The names of placeholders, those without one by their number, and whether their format is that of a number.
pub(super) fn placeholders(braces: &[String]) -> Vec<(String, bool)> {
    let mut unnamed = 0;
    let named = |inside: &String| {
        let (name, format) = inside.split_once(':').unwrap_or((inside, ""));
        let name = match name {
            "" => {
                unnamed += 1;
                (unnamed - 1).to_string()
            }
            name => name.to_owned(),
        };
        (name, format.contains(['.', '+']))
    };
    braces.iter().map(named).collect()
}

impl Pattern {
    /// The pattern of a template and its translation; `None` where they do not have the same placeholders.
    pub(super) fn new(template: &str, translation: &str) -> Option<Self> {
        let (literals, braces) = taken_apart(template);
        let known = placeholders(&braces);
        let mut kinds: Vec<Option<Kind>> = vec![None; known.len()];
        let (texts, values) = taken_apart(translation);
        let mut pieces = vec![Piece::Text(texts[0].clone())];
        for (value, text) in values.iter().zip(&texts[1..]) {
            let (name, mark) = value.split_once(':').unwrap_or((value, ""));
            let at = known.iter().position(|(known, _)| known == name)?;
            kinds[at] = Some(match mark {
                "n" => Kind::Number,
                "t" => Kind::Words,
                "k" => Kind::Known,
                "p" => Kind::Name,
                "" if known[at].1 => Kind::Number,
                "" => Kind::Name,
                _ => return None,
            });
            pieces.push(Piece::Value(at));
            pieces.push(Piece::Text(text.clone()));
        }
        // A value that stands twice in the template is named once.
        let first = |name: &String| known.iter().position(|(known, _)| known == name);
        let kinds: Option<Vec<Kind>> = known.iter().map(|(name, _)| kinds[first(name)?]).collect();
        Some(Self { literals, kinds: kinds?, pieces })
    }

    /// The same in the words of the template: only its numbers are written as a language does.
    pub(super) fn in_its_own_words(self) -> Self {
        let mut pieces = vec![Piece::Text(self.literals[0].clone())];
        for (k, literal) in self.literals[1..].iter().enumerate() {
            pieces.extend([Piece::Value(k), Piece::Text(literal.clone())]);
        }
        Self { pieces, ..self }
    }

    /// How many letters of it are its own: where several match, the longest tells most.
    pub(super) fn own_letters(&self) -> usize {
        self.literals.iter().map(String::len).sum()
    }

    /// Whether it can be told where each of its values ends.
    #[cfg(test)]
    pub(super) fn is_told_apart(&self) -> bool {
        let mut between = self.literals.iter().skip(1).zip(self.kinds.windows(2));
        self.own_letters() > 0 && between.all(|(text, two)| !text.is_empty() || two.contains(&Kind::Number))
    }

    /// The kinds of its values, in the template's order.
    #[cfg(test)]
    pub(super) fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// What stands in a text where the template has its placeholders; `None` where it is another text. Linear in the text: each value ends
    /// where the next literal comes first (and the number behind it, if one does), a number where its digits end, and the last one where the
    /// template's end begins.
    fn captures<'t>(&self, text: &'t str) -> Option<Vec<&'t str>> {
        let mut rest = text.strip_prefix(self.literals[0].as_str())?;
        // Tells most of the others at once.
        if self.literals[1..].last().is_some_and(|end| !rest.ends_with(end.as_str())) {
            return None;
        }
        let mut captures = Vec::with_capacity(self.kinds.len());
        for (k, (kind, literal)) in self.kinds.iter().zip(&self.literals[1..]).enumerate() {
            let length = match kind {
                Kind::Number => number_length(rest)?,
                _ if k + 1 == self.kinds.len() => rest.strip_suffix(literal.as_str())?.len(),
                _ => self.end_of_words(k, rest)?,
            };
            let (capture, after) = rest.split_at(length);
            captures.push(capture);
            rest = after.strip_prefix(literal.as_str())?;
        }
        rest.is_empty().then_some(captures)
    }

    /// Where words end that another value follows.
    fn end_of_words(&self, k: usize, text: &str) -> Option<usize> {
        let literal = self.literals[k + 1].as_str();
        if self.kinds[k + 1] != Kind::Number {
            return text.find(literal);
        }
        let next = self.literals[k + 2].as_str();
        let mut ends = text.match_indices(literal).map(|(at, _)| at);
        ends.find(|at| {
            let number = &text[at + literal.len()..];
            number_length(number).is_some_and(|length| number[length..].starts_with(next))
        })
    }

    /// The translation of a text: numbers by the one function, words by the other, which knows some; `None` where it is another text.
    pub(super) fn translated(
        &self,
        text: &str,
        number: impl Fn(&str) -> String,
        words: impl Fn(&str) -> Option<String>,
    ) -> Option<String> {
        let captures = self.captures(text)?;
        let mut told = String::new();
        for piece in &self.pieces {
            match piece {
                Piece::Text(text) => told.push_str(text),
                Piece::Value(at) => match (self.kinds[*at], captures[*at]) {
                    (Kind::Number, value) => told.push_str(&number(value)),
                    (Kind::Words, value) => told.push_str(words(value).as_deref().unwrap_or(value)),
                    (Kind::Known, value) => told.push_str(&words(value)?),
                    (Kind::Name, value) => told.push_str(value),
                },
            }
        }
        Some(told)
    }
}

/// How many bytes of a text are a number as the library writes one: a sign, digits, thousands parted by commas, decimals; or none at all.
fn number_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    for word in ["NaN", "inf"] {
        if text[sign..].starts_with(word) {
            return Some(sign + word.len());
        }
    }
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut at = sign + digits(sign);
    if at == sign {
        return None;
    }
    // Thousands.
    while bytes.get(at) == Some(&b',') && digits(at + 1) == 3 {
        at += 4;
    }
    if bytes.get(at) == Some(&b'.') && digits(at + 1) > 0 {
        at += 1 + digits(at + 1);
    }
    if bytes.get(at) == Some(&b'e') && digits(at + 1) > 0 {
        at += 1 + digits(at + 1);
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(pattern: &Pattern, text: &str) -> Option<String> {
        pattern.translated(text, |n| format!("<{n}>"), |w| (w != "?").then(|| format!("[{w}]")))
    }

    #[test]
    fn values_are_captured_and_put_in_by_their_names() {
        let pattern =
            Pattern::new("only {own} of {} points ({:.0} %): {why}", "{why:t}, {1} % = {own:n} / {0}").unwrap();
        assert_eq!(
            told(&pattern, "only -12 of P 1 of 3 points (4.5 %): no (x)").unwrap(),
            "[no (x)], <4.5> % = <-12> / P 1 of 3"
        );
        for other in ["only x of 3 points (4 %): no", "only 1 of 3 points (4 %) no", " only 1 of 3 points (4 %): ", ""]
        {
            assert_eq!(told(&pattern, other), None, "{other}");
        }
    }

    #[test]
    fn words_end_before_the_number_that_follows_them() {
        let pattern = Pattern::new("hold the {what} {n:.0} times", "{n} x {what}").unwrap();
        assert_eq!(told(&pattern, "hold the turn 2 through 3 4 times").unwrap(), "<4> x turn 2 through 3");
    }

    #[test]
    fn a_number_ends_where_its_digits_do() {
        for (text, length) in
            [("1,204,331 of", 9), ("12, 3", 2), ("3.", 1), ("-0.25 mm", 5), ("+1", 2), ("NaN", 3), ("1.5e12 m", 6)]
        {
            assert_eq!(number_length(text), Some(length), "{text}");
        }
        assert_eq!(["", "-", "x", ".5", "−"].map(number_length), [None; 5]);
    }

    #[test]
    fn words_may_be_unknown_unless_the_sentence_is_made_of_them() {
        let [words, known] = ["{a:t}.", "{a:k}."].map(|to| Pattern::new("so {a}", to).unwrap());
        assert_eq!(
            [told(&words, "so it"), told(&known, "so it")],
            [Some("[it].".to_owned()), Some("[it].".to_owned())]
        );
        assert_eq!([told(&words, "so ?"), told(&known, "so ?")], [Some("?.".to_owned()), None]);
    }

    #[test]
    fn a_translation_names_each_placeholder() {
        assert!(Pattern::new("{a} b", "c").is_none());
        assert!(Pattern::new("b", "{a} c").is_none());
        assert!(Pattern::new("{a} b", "{a:x} c").is_none());
        let braces = Pattern::new("{{a}} {b}", "{b} {{c}}").unwrap();
        assert_eq!(told(&braces, "{a} 1").unwrap(), "1 {c}");
    }
}
