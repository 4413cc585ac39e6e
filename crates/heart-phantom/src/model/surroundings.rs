//! The surroundings of the heart: sources and media, in the form that the projections need.

use super::activity::Background;
use super::attenuation::Attenuation;
use crate::error::PhantomError;
use revolve_voxel::{Assembly, Organ, Organs};

/// Active and attenuating objects around the heart.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    organs: Organs,
    /// Media that attenuate instead of the organs.
    media: Option<Organs>,
    /// Attenuation of the heart in 1/cm, if it is not that of the media.
    pub(crate) heart: Option<f64>,
    /// Concentration of a background without attenuation and organs that contains the heart; the heart then adds the difference.
    even: Option<f64>,
}

impl Surroundings {
    pub(crate) fn new(
        background: Option<&Background>,
        organs: Option<&Organs>,
        attenuation: Option<&Attenuation>,
    ) -> Result<Self, PhantomError> {
        let mut sources = Vec::new();
        if let Some(around) = background {
            sources.push(around.organ()?);
        }
        sources.extend(organs.iter().flat_map(|organs| organs.as_slice()));
        let around = (sources.iter()).fold(0.0, |most: f64, organ| most.max(organ.attenuation));
        let attenuation = attenuation.filter(|own| own.coefficient.max(around) > 0.0);
        let (media, heart) = match attenuation {
            None => (Some(Vec::new()), None),
            Some(own) => match own.torso() {
                Some(medium) => (Some(vec![medium]), None),
                None => (None, Some(own.coefficient)),
            },
        };
        let is_even = attenuation.is_none() && organs.is_none();
        Ok(Self {
            organs: Organs::new(sources)?,
            media: media.map(Organs::new).transpose()?,
            heart,
            even: is_even.then(|| background.map_or(0.0, |around| around.concentration)),
        })
    }

    /// Returns the background, if there is one, and the organs.
    pub(crate) fn sources(&self) -> &[Organ] {
        self.organs.as_slice()
    }

    /// Whether the surroundings of the heart contain activity.
    pub(crate) fn is_active(&self) -> bool {
        self.organs.is_active()
    }

    /// The concentration around the heart, if the heart has no other effect on the surroundings.
    pub(crate) fn even(&self) -> Option<f64> {
        self.even
    }

    /// Whether the heart changes the projection of the activity behind it.
    pub(crate) fn changes_behind(&self) -> bool {
        self.is_active() && self.heart.is_some()
    }

    /// The surroundings without the heart.
    pub(crate) fn alone(&self) -> Assembly<'_> {
        let assembly = Assembly::new(&self.organs);
        match &self.media {
            Some(media) => assembly.with_media(media),
            None => assembly,
        }
    }
}
